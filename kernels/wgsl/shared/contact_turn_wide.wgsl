// The same for a model with few groups, whose time is that of the group with most around it: each turn waits for what
// it reads. Many groups would rather have the memory, and have few near by.

const TURN: u32 = 3u;

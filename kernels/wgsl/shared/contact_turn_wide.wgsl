// The same for a model with few groups: room for the particles of the group and five times as many of others. Not for all that its
// threads can bring in one go, though several groups may be near: few of their particles are, and a workgroup that takes more memory
// waits until others are done. On an H200 with 800 groups 2 KB more made a frame take 12 % longer.

const TURN: u32 = 6u;

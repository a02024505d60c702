// The same for a model with few groups: room for the particles of the group and as many of others as its threads can bring in one go.
// Not for more, though several groups may be near: few of their particles are, and a workgroup that takes more memory waits until
// others are done. On an H200 with 800 groups 8 KB more made a frame take half as long again.

const TURN: u32 = 1u + CREWS;

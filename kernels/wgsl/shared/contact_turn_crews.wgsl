// The same for a model with few groups: room for the particles of the group, as many others as a workgroup has threads, and a group
// more. Not for all that threads bring in one go: few of them are near, and a workgroup that takes more memory waits until others are
// done. On an H200 with 800 groups 2 KB more than without that last group made a frame take a tenth longer.

const TURN: u32 = 2u + CREWS;

// The box around a group, by all threads of its workgroup together.

// What threads of a workgroup tell each other: the particles of some groups.
const STAGE: u32 = TURN * GROUP;
var<workgroup> stage: array<vec4<u32>, STAGE>;

fn stage_position(at: u32) -> vec3f {
    return bitcast<vec3f>(stage[at].xyz);
}

// The smallest box with the positions of the first GROUP threads. The stage must not be in use by others than these.
fn group_box(thread: u32, position: vec3f) -> Box {
    if thread < GROUP {
        stage[thread] = vec4<u32>(bitcast<vec3<u32>>(position), 0u);
    }
    workgroupBarrier();
    if thread < 16u {
        let at = 4u * (thread % 8u);
        let a = stage_position(at);
        let b = stage_position(at + 1u);
        let c = stage_position(at + 2u);
        let d = stage_position(at + 3u);
        let corner = select(max(max(a, b), max(c, d)), min(min(a, b), min(c, d)), thread < 8u);
        stage[GROUP + thread] = vec4<u32>(bitcast<vec3<u32>>(corner), 0u);
    }
    workgroupBarrier();
    var box = Box(stage_position(GROUP), stage_position(GROUP + 8u));
    for (var k = 1u; k < 8u; k += 1u) {
        box.low = min(box.low, stage_position(GROUP + k));
        box.high = max(box.high, stage_position(GROUP + 8u + k));
    }
    return box;
}

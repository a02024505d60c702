// Position [m] and, as the fourth number, inverse mass [1/kg], 0 while held; velocity [m/s] and mass
// [kg]. Stages that gather from neighbours read one pair of buffers and write the other.

@group(0) @binding(3) var<storage, read> position_in: array<vec4f>;
@group(0) @binding(4) var<storage, read> velocity_in: array<vec4f>;

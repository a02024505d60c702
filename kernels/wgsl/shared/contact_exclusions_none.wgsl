// The response leaves no pair out.

fn is_left_out(particle: u32, partner: u32) -> bool {
    return false;
}

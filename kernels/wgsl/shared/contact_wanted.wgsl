// When the list of groups is built.

// Whether it is to be built now, if it was built at use `built`.
fn contact_list_is_wanted(built: u32) -> bool {
    return !is_stopped() && (built == 0u || atomicLoad(&status.contact_stale) > built);
}

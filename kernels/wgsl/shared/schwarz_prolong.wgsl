// NUMERICS section 5, the preconditioner `schwarz`: x += P of the unknowns of nodes of the level above, which a workgroup of TEAM threads
// has at `scaled`, those of the nodes from `first` on.

fn schwarz_prolong(below: SchwarzLevel, thread: u32, first: u32, nodes: u32) {
    workgroupBarrier();
    let begin = NODE * schwarz_tables[below.groups + first];
    let end = NODE * schwarz_tables[below.groups + first + nodes];
    var node = first;
    for (var at = begin + thread; at < end; at += TEAM) {
        while NODE * schwarz_tables[below.groups + node + 1u] <= at {
            node += 1u;
        }
        let row = below.prolongation + NODE * at;
        let own = NODE * (node - first);
        var sum = 0.0;
        for (var k = 0u; k < NODE; k += 1u) {
            sum = fma(schwarz_number(row + k), scaled[own + k], sum);
        }
        schwarz_vectors[below.first + at] += sum;
    }
}

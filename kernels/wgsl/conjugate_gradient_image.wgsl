// NUMERICS section 5, conjugate gradient, first half of an iteration: s = S A c and the sum of c . s.
//!include model vectors symmetric links matrix matrix_entry matrix_springs matrix_row solve
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!if penalty
//!include contact_row
//!end
//!if not penalty
//!include contact_row_none
//!end
//!if triangles
//!include contact_table contact_times triangle_row
//!end
//!if not triangles
//!include triangle_row_none
//!end
//!if fabric
//!include element_row
//!end
//!if not fabric
//!include element_row_none
//!end
//!include filter solve_image

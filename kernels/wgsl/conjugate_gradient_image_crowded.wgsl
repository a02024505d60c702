// NUMERICS section 5, conjugate gradient, first half of an iteration where particles are in many contacts of triangles: after `conjugate_gradient_contacts`.
//!include model vectors symmetric links matrix matrix_entry matrix_springs matrix_row solve
//!if colliders
//!include constraint
//!end
//!if not colliders
//!include constraint_none
//!end
//!include contact_row_none contact_table contact_terms triangle_row_terms
//!if fabric
//!include element_row
//!end
//!if not fabric
//!include element_row_none
//!end
//!include filter solve_image

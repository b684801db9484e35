//! Hierarchical compression of integral operators.

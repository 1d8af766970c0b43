"""From sweeps of the finite-element cell to a fitted, judged section law."""

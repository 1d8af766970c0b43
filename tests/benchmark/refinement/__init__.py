"""Refinement of the period cell's mesh, for every winding that ships: what a mesh is wrong by."""

"""C99 sources that predict on a controller without Python: the core, a rod as constants, and an example."""

from rodmodel.core.export._folder import export as export

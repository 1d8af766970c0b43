"""Contact between chamber walls."""

from fem_reference.walls.pair_forces import WallPairs as WallPairs
from fem_reference.walls.self_contact import ContactPath as ContactPath
from fem_reference.walls.self_contact import WallContact as WallContact

"""Threads by name.

A name stands for the modulus of the fibre. A twisted yarn is softer than its fibre, has voids, and differs
from maker to maker, so constants from a tensile test of one's own thread are better.
"""

from collections.abc import Mapping

from fem_reference.geometry.winding import Thread

#: By name. Kevlar is the thread of Connolly et al. (2015), Soft Robotics 2(1), 26–32, and the paper's.
#: Polyester and nylon 6.6 have the initial moduli of fibres of medium tenacity in Morton and Hearle (2008),
#: Physical Properties of Textile Fibres, Table 13.2: 10.6 and 3.0 N/tex, times 1380 and 1140 kg/m³. Their
#: radius is that of the first, until a design says another.
THREADS: Mapping[str, Thread] = {
    "kevlar": Thread(),
    "polyester": Thread(young_modulus=14.6e9),
    "nylon": Thread(young_modulus=3.42e9),
}

"""Extension module that `_build.py` and CMakeLists.txt make: the core through cffi."""

from typing import Any

ffi: Any
lib: Any

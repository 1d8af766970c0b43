"""What the scripts that make finite-element points share: a file of paths that a stopped run goes on with."""

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.progress import track


def arguments(description: str | None, file: Path, mesh: str | None = None) -> argparse.ArgumentParser:
    """Arguments of such a script; ``mesh`` is the default level, None for that of each winding."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("file", nargs="?", type=Path, default=file)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="paths to follow")
    told = mesh or "the winding's own"
    parser.add_argument("--elements", default=mesh, help=f"mesh level (default: {told})")
    return parser


def complete(
    options: argparse.Namespace, paths: Sequence[tuple[Any, ...]], trace: Callable[[Any], dict[str, Any]]
) -> None:
    """Follow the paths, named by their first entry, that the file lacks; each is kept once it is done."""
    held = json.loads(options.file.read_text()) if options.file.exists() else {}
    wanted = [p for p in paths if p[0] not in held and (options.only is None or p[0] in options.only)]
    for path in track(wanted, "paths"):
        held[path[0]] = trace(path)
        options.file.parent.mkdir(parents=True, exist_ok=True)
        partial = options.file.with_suffix(".part")
        partial.write_text(json.dumps(held, indent=1) + "\n")
        partial.replace(options.file)
    print(f"{len(held)} paths in {options.file}")

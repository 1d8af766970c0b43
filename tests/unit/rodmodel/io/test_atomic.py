"""Writing that leaves the old file or the whole new one, whatever fails on the way."""

import errno
import io
import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from rodmodel.io import atomic_part, drop_parts, write_atomically
from tests.faults import full_disk, killed_at_every_write


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "file.txt"
    path.write_text("old")
    return path


def test_a_new_file_is_written_and_an_old_one_replaced(tmp_path: Path, file: Path) -> None:
    write_atomically(tmp_path / "new.txt", "θ = 1\n")
    write_atomically(str(file), "new")
    assert (tmp_path / "new.txt").read_text(encoding="utf-8") == "θ = 1\n"
    assert file.read_text() == "new"
    assert len(list(tmp_path.iterdir())) == 2


def fail_to_write(monkeypatch: pytest.MonkeyPatch) -> None:
    """Opened files write half of a text, and then the disk is full."""
    opened = Path.open

    def open_full(self: Path, *arguments: str, **options: str) -> io.TextIOWrapper:
        stream = opened(self, *arguments, **options)
        write = stream.write

        def write_half(text: str) -> int:
            write(text[: len(text) // 2])
            stream.flush()
            raise OSError(errno.ENOSPC, "No space left on device")

        stream.write = write_half
        return stream

    monkeypatch.setattr(Path, "open", open_full)


def fail_to_sync(monkeypatch: pytest.MonkeyPatch) -> None:
    def sync(descriptor: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "fsync", sync)


def fail_to_replace(monkeypatch: pytest.MonkeyPatch) -> None:
    def replace(self: Path, target: Path) -> Path:
        raise OSError(errno.EXDEV, "Invalid cross-device link")

    monkeypatch.setattr(Path, "replace", replace)


@pytest.mark.parametrize(
    ("fail", "number"),
    [(fail_to_write, errno.ENOSPC), (fail_to_sync, errno.EIO), (fail_to_replace, errno.EXDEV)],
)
def test_a_failure_leaves_the_old_file_whole_and_no_part(
    file: Path, monkeypatch: pytest.MonkeyPatch, fail, number: int
) -> None:
    fail(monkeypatch)
    with pytest.raises(OSError) as caught:  # noqa: PT011 (the number says which)
        write_atomically(file, "new text")
    monkeypatch.undo()
    assert caught.value.errno == number
    assert file.read_text() == "old"
    assert list(file.parent.iterdir()) == [file]


def test_the_text_is_on_the_disk_before_it_has_the_name(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced = []
    sync = os.fsync

    def note(descriptor: int) -> None:
        is_folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        synced.append(("folder" if is_folder else "file", file.read_text()))
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", note)
    write_atomically(file, "new")
    assert synced == [("file", "old"), ("folder", "new")]


def test_permissions_and_links_stay(file: Path) -> None:
    file.chmod(0o600)
    link = file.parent / "link.txt"
    link.symlink_to(file.name)
    write_atomically(link, "new")
    assert link.is_symlink()
    assert file.read_text() == "new"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_a_name_as_long_as_names_can_be_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("n" * 255)
    write_atomically(path, "text")
    assert path.read_text() == "text"


def test_a_device_is_not_replaced() -> None:
    write_atomically(os.devnull, "text")
    assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)


@pytest.mark.parametrize("name", [".", "no/such/folder.txt"])
def test_a_place_that_takes_no_file_raises(tmp_path: Path, name: str) -> None:
    with pytest.raises(OSError, match=r"Is a directory|No such file"):
        write_atomically(tmp_path / name, "text")
    assert list(tmp_path.iterdir()) == []


def test_bytes_are_written_as_they_are(file: Path) -> None:
    write_atomically(file, b"\xff\r\n")
    assert file.read_bytes() == b"\xff\r\n"


def test_a_library_writes_to_a_part_that_takes_the_name_at_the_end(file: Path) -> None:
    with atomic_part(file) as part:
        part.write_text("new")
        assert part.parent == file.parent
        assert file.read_text() == "old"
    assert file.read_text() == "new"
    assert list(file.parent.iterdir()) == [file]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_of_the_library_leaves_the_old_file_and_no_part(
    file: Path, error: type[BaseException]
) -> None:
    def write() -> None:
        with atomic_part(file) as part:
            part.write_text("half")
            raise error

    with pytest.raises(error):
        write()
    assert file.read_text() == "old"
    assert list(file.parent.iterdir()) == [file]


def test_a_full_disk_leaves_the_old_file(file: Path) -> None:
    with full_disk(1024), pytest.raises(OSError, match="too large"):
        write_atomically(file, "n" * 1025)
    assert file.read_text() == "old"
    assert list(file.parent.iterdir()) == [file]


def test_a_kill_at_any_touch_of_the_disk_leaves_a_whole_file(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []

    def after(attempt: int) -> None:
        found.append(file.read_text())
        drop_parts(file.parent)
        assert list(file.parent.iterdir()) == [file]
        file.write_text("old")

    kills = killed_at_every_write(monkeypatch, lambda attempt: write_atomically(file, "new"), after)
    # Before a part is begun, opened, opened again to be synced, synced, renamed; then the folder is synced.
    assert kills == 6
    assert found == ["old"] * 5 + ["new"] * 2


# Kills itself with SIGKILL before the touch of the disk whose number it is given.
SCRIPT = """
import os, signal, sys
from pathlib import Path
from rodmodel.io import write_atomically

left = iter(range(int(sys.argv[2])))

def counted(function):
    def call(*arguments, **options):
        if next(left, None) is None:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*arguments, **options)
    return call

for name in ("touch", "open", "replace"):
    setattr(Path, name, counted(getattr(Path, name)))
os.fsync = counted(os.fsync)
write_atomically(sys.argv[1], "new")
"""


def test_sigkill_at_any_touch_of_the_disk_leaves_a_whole_file(file: Path) -> None:
    for touches in range(20):
        before = file.read_text()
        done = subprocess.run([sys.executable, "-c", SCRIPT, file, str(touches)], check=False, timeout=60)
        if done.returncode == 0:
            break
        assert done.returncode == -signal.SIGKILL
        assert file.read_text() in (before, "new")
    assert touches >= 5
    assert file.read_text() == "new"
    drop_parts(file.parent)
    assert list(file.parent.iterdir()) == [file]

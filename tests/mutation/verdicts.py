"""Verdicts on the mutants of one module, kept in a file: a run that was stopped goes on."""

import hashlib
import json
from pathlib import Path

from tests.mutation.mutants import Mutant
from tests.mutation.sandbox import ROOT, Verdict
from tests.mutation.subjects import Subject

FOLDER = ROOT / "build" / "mutants"


class Verdicts:
    """Verdicts by the key of the mutant, for one text of the module and one choice and text of its tests."""

    def __init__(self, subject: Subject) -> None:
        files = [subject.module, *(test.partition("::")[0] for test in subject.tests)]
        texts = [repr(subject).encode(), *((ROOT / name).read_bytes() for name in files)]
        state = hashlib.sha256(b"\0".join(texts)).hexdigest()[:12]
        self._file = FOLDER / f"{Path(subject.module).stem.strip('_')}-{state}.jsonl"
        self._known: dict[str, Verdict] = {}
        if self._file.exists():
            for line in self._file.read_text().splitlines():
                record = json.loads(line)
                self._known[record["key"]] = Verdict(record["outcome"], record["seconds"])

    def of(self, mutant: Mutant) -> Verdict | None:
        """Return what is known of a mutant."""
        return self._known.get(mutant.key)

    def add(self, mutant: Mutant, verdict: Verdict) -> None:
        """Keep a verdict, at once."""
        self._known[mutant.key] = verdict
        self._file.parent.mkdir(parents=True, exist_ok=True)
        record = {
            "key": mutant.key,
            **verdict._asdict(),
            "line": mutant.line,
            "old": mutant.old,
            "new": mutant.new,
        }
        with self._file.open("a") as file:
            file.write(json.dumps(record, ensure_ascii=False) + "\n")

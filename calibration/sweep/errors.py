"""Why a sweep ends before its paths do."""


class SweepError(RuntimeError):
    """The cluster is out of reach, or worker processes died; the states found so far are on file."""


class NoSchedulerError(SweepError):
    """No scheduler answers, or it does not know this client."""


class WorkersDiedError(SweepError):
    """Processes died again and again on one path."""

    def __init__(self, path: str) -> None:
        super().__init__(f"worker processes died on path {path}")
        self.path = path

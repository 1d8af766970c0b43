"""Errors that end a sweep before its paths are finished."""


class SweepError(RuntimeError):
    """Error for an unreachable cluster or dead workers; the states so far are on file."""


class NoSchedulerError(SweepError):
    """Error for a scheduler that does not answer, or refuses this client."""


class WorkersDiedError(SweepError):
    """Error for worker processes that died repeatedly on one path."""

    def __init__(self, path: str) -> None:
        super().__init__(f"worker processes died on path {path}")
        self.path = path

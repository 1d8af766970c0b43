"""A sweep on a cluster that asks for certificates, begun by the commands of the how-to page."""

import os
import shutil
import subprocess
import sys
from contextlib import ExitStack, contextmanager

import dask
import pytest
from distributed import Client
from manufactured_cell import ManufacturedTracer

from calibration.sweep import LoadingPath, SweepError, run_sweep
from fem_reference import Load

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates")

PATH = LoadingPath(
    "a", "train", tuple(Load(pressure=(1e3 * k, 0.0, 0.0), moment=(0.0, 0.0, 0.0)) for k in (1, 2))
)
_WAIT = "60s"


def _openssl(words, cwd):
    subprocess.run(["openssl", *words.split()], cwd=cwd, check=True, capture_output=True)


def _authority(folder, name):
    """Certificate authority with one certificate that it signed, for this run of the tests."""
    new, ca = "-newkey rsa:2048 -nodes", f"{name}-ca"
    _openssl(f"req -x509 {new} -keyout {ca}.key -out {ca}.pem -days 1 -subj /CN={ca}", folder)
    _openssl(f"req {new} -keyout {name}.key -out {name}.csr -subj /CN={name}", folder)
    signed_by = f"-CA {ca}.pem -CAkey {ca}.key -CAcreateserial"
    _openssl(f"x509 -req -in {name}.csr {signed_by} -out {name}.pem -days 1", folder)


def _configured(folder, name, trusted):
    """Dask's settings for one who has the certificate `name` and trusts the authority of `trusted`."""
    tls = "distributed.comm.tls"
    settings = {
        f"{tls}.ca-file": str(folder / f"{trusted}-ca.pem"),
        "distributed.comm.require-encryption": True,
    }
    for role in ("scheduler", "worker", "client"):
        settings[f"{tls}.{role}.cert"] = str(folder / f"{name}.pem")
        settings[f"{tls}.{role}.key"] = str(folder / f"{name}.key")
    return settings


@contextmanager
def _process(*words):
    process = subprocess.Popen([sys.executable, *words], stderr=subprocess.DEVNULL, env=_environment())
    try:
        yield
    finally:
        process.terminate()
        process.wait(30)


def _environment():
    """The tracer is a module of the tests, which the workers import too."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Folder of the certificates, and the address of a scheduler that asks for one."""
    folder = tmp_path_factory.mktemp("certificates")
    for name in ("ours", "stranger"):
        _authority(folder, name)
    file = folder / "scheduler.json"
    common = f"--host 127.0.0.1 --no-dashboard --scheduler-file {file} --tls-ca-file {folder}/ours-ca.pem"
    common += f" --tls-cert {folder}/ours.pem --tls-key {folder}/ours.key"
    with ExitStack() as running:
        scheduler = f"-m distributed.cli.dask_scheduler --protocol tls --port 0 {common}"
        worker = f"-m distributed.cli.dask_worker --nthreads 1 --local-directory {folder} {common}"
        running.enter_context(_process(*scheduler.split()))
        running.enter_context(_process(*worker.split()))
        with (
            dask.config.set(_configured(folder, "ours", "ours")),
            Client(scheduler_file=file, timeout=_WAIT) as client,
        ):
            client.wait_for_workers(1, timeout=60)
            address = client.scheduler.address
        yield folder, address


def test_a_sweep_with_the_certificate_that_dask_is_told_of_runs(cluster, tmp_path):
    folder, address = cluster
    assert address.startswith("tls://")
    with dask.config.set(_configured(folder, "ours", "ours")):
        there = run_sweep(ManufacturedTracer(), [PATH], tmp_path / "there", scheduler=address)
    here = run_sweep(ManufacturedTracer(), [PATH], tmp_path / "here", workers=1)
    assert there["a"].end == {"attempts": 1}
    assert [s["curvature"] for s in there["a"].states] == [s["curvature"] for s in here["a"].states]


@pytest.mark.parametrize(
    ("trusted", "reason"),
    # Which of three the client sees of a refusal is a matter of time.
    [("ours", "(EOF occurred|[Rr]eset|unknown ca)"), ("stranger", "TLS certificate does not match")],
    ids=["the scheduler refuses it", "the sweep refuses the scheduler"],
)
def test_a_certificate_of_another_authority_gets_nothing(cluster, tmp_path, monkeypatch, trusted, reason):
    # Long enough for a first attempt to end on a machine that is busy.
    monkeypatch.setattr("calibration.sweep.cluster._CONNECT", 4.0)
    folder, address = cluster
    with (
        dask.config.set(_configured(folder, "stranger", trusted)),
        pytest.raises(SweepError, match=f"no scheduler answers at tls://.*{reason}"),
    ):
        run_sweep(ManufacturedTracer(), [PATH], tmp_path, scheduler=address)


def test_a_client_without_encryption_gets_nothing(cluster, tmp_path, monkeypatch):
    monkeypatch.setattr("calibration.sweep.cluster._CONNECT", 2.0)
    address = cluster[1].replace("tls://", "tcp://")
    with pytest.raises(SweepError, match=r"no scheduler answers at tcp://.*reset"):
        run_sweep(ManufacturedTracer(), [PATH], tmp_path, scheduler=address)

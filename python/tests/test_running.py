"""Threads, interruption, memory, and the command."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from conftest import MODELS, Given

import flexbody

LONG = MODELS / "gear_disc" / "model.toml"


def threads() -> int:
    """Threads of this process."""
    return len(list(Path("/proc/self/task").iterdir()))


def test_other_threads_go_on(bracket: Given) -> None:
    model, done, count = bracket.model(), threading.Event(), 0

    def work() -> None:
        model.convert(modes=30)
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    # With the lock held there would be no turn until the work is done.
    while not done.is_set():
        count += 1
        time.sleep(0.001)
    thread.join()
    assert count > 5


def test_two_bodies_at_once(bracket: Given, cube: Given) -> None:
    models, barrier = [bracket.model(), cube.model()], threading.Barrier(2)

    def convert(model: flexbody.Model) -> flexbody.Body:
        barrier.wait()
        return model.convert(modes=14)

    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(convert, models))
    assert together == [model.convert(modes=14) for model in models]


@pytest.mark.skipif(not hasattr(signal, "SIGINT") or os.name == "nt", reason="signals of Unix")
def test_ctrl_c_ends_a_conversion() -> None:
    # A shell starts what it runs in the background with the signal ignored: then no exception would come.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        ctrl_c_ends_a_conversion()
    finally:
        signal.signal(signal.SIGINT, before)


def ctrl_c_ends_a_conversion() -> None:
    model = flexbody.read_model(LONG)
    model.convert(modes=2)
    time.sleep(0.5)
    idle = threads() if sys.platform == "linux" else 0
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    begun = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        while time.monotonic() - begun < 60:
            model.convert(modes=400)
    timer.join()
    # The caller has its exception at once; the work ends at its next step.
    assert time.monotonic() - begun < 10
    if sys.platform == "linux":
        until = time.monotonic() + 120
        while threads() > idle and time.monotonic() < until:
            time.sleep(0.05)
        assert threads() <= idle
    assert model.convert(modes=2).n_modes == 2


@pytest.mark.skipif(sys.platform != "linux", reason="memory as Linux tells it")
def test_ten_times_the_same_does_not_leak(cube: Given) -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def once() -> None:
        body = cube.model().convert(modes=20)
        _ = body.shapes, body.W2, body.report()
        body.equations_of_motion().mass_matrix([0.0] * 20)

    for _ in range(10):
        once()
    before = resident()
    for _ in range(10):
        once()
    grown = resident() - before
    assert grown < 4 << 20, f"{grown} bytes more after ten conversions"


def run(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "flexbody", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_exit_codes_of_the_command(tmp_path: Path) -> None:
    version = run("--version")
    assert (version.returncode, version.stdout) == (0, f"flexbody {flexbody.__version__}\n")
    assert run("--help").returncode == 0 and "convert" in run("--help").stdout
    assert run("transform").returncode == 2
    missing = run("inspect", tmp_path / "none.flex.h5", "--json")
    assert missing.returncode == 2 and '"exit_code": 2' in missing.stdout
    made = run("convert", MODELS / "cube_hex8" / "model.toml", "-o", tmp_path / "cube.flex.h5", "--modes", 4)
    assert made.returncode == 0, made.stderr
    assert run("check", tmp_path / "cube.flex.h5").returncode == 0
    assert run("compare", tmp_path / "cube.flex.h5", tmp_path / "cube.flex.h5").returncode == 0


FORKED = """
import os, sys, flexbody
def child(work):
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        try:
            print(work(), flush=True)
        except flexbody.FlexbodyError as error:
            print(type(error).__name__, *error.codes, flush=True)
        os._exit(0)
    os.waitpid(pid, 0)
model, body = sys.argv[1:]
convert = lambda: flexbody.convert(model, modes=4).n_modes
child(convert)
print(convert())
flexbody.convert(model, modes=4).write(body)
child(convert)
child(lambda: flexbody.read_model(model).name)
child(lambda: flexbody.read(body).write(body))
child(lambda: flexbody.read(body).n_modes)
child(lambda: len(flexbody.read(body).equations_of_motion().mass_matrix([0.0] * 4)))
print(convert())
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="fork of Unix")
def test_work_after_a_fork_is_refused(tmp_path: Path) -> None:
    words = [sys.executable, "-W", "ignore", "-c", FORKED, MODELS / "cube_hex8" / "model.toml", tmp_path / "body.flex.h5"]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=120)
    refused = "ResourceError FB606"
    assert done.stdout.split("\n")[:-1] == ["4", "4", refused, refused, refused, "4", "10", "4"]


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1, signal.SIGXCPU])
def test_an_interrupted_command_leaves_nothing(tmp_path: Path, number: signal.Signals) -> None:
    words = ["convert", str(LONG), "-o", str(tmp_path / "gear.flex.h5"), "--modes", "400", "--allow-long"]
    process = subprocess.Popen([sys.executable, "-m", "flexbody", *words], stderr=subprocess.PIPE, text=True)
    while not list(tmp_path.iterdir()):
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    code = 130 if number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) else -number
    assert process.returncode == code and said.endswith(": no unfinished file is left\n")
    assert list(tmp_path.iterdir()) == []

"""Two hours of one session: the memory of acquisition and recorder, and what its raw log takes.

    python benchmarks/long_session_memory.py [--minutes 120] [--cycle 0.004] [--keep FOLDER]

A whole session of the simulated RX130L joint 3 in simulated time, so that two hours take minutes. Resident memory is what
the kernel says of the two processes (VmRSS, VmHWM) at twenty moments of the plan: neither may grow once the rings are
full, and the recorder stays below 125 MB. At the end the raw log's size, what it holds as text, and what its compression
cost in processor time, measured again by itself.
"""

import argparse
import gzip
import json
import tempfile
import time
from pathlib import Path

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from daq.raw_log import raw_log_of, text_of
from daq.rig import Rig
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession

LARGEST_RECORDER = 125.0
"""MB"""
FLAT = 1.05
"""the last quarter's memory over that of the second quarter"""
MOMENTS = 20


def resident(process: int) -> tuple[float, float]:
    """MB now, and at most so far."""
    status = Path(f"/proc/{process}/status").read_text()
    fields = dict(line.split(":", 1) for line in status.splitlines() if ":" in line)
    return tuple(int(fields[name].split()[0]) / 1024 for name in ("VmRSS", "VmHWM"))  # type: ignore[return-value]


def back_and_forth(minutes: float) -> ExcitationPlan:
    """Between two places at moderate speed, for that long."""
    moves = (Move(to=(1.2,), duration=2.0, ramp=0.5), Move(to=(0.4,), duration=2.0, ramp=0.5))
    return ExcitationPlan(joints=("j3",), start=(0.4,), phases=moves * round(minutes * 15))


def compression(log: Path) -> dict[str, float]:
    """Sizes in MB, the ratio, and MB of text that are compressed in a second of processor time."""
    texts, sample = 0, bytearray()
    for text in text_of(log):
        texts += len(text)
        if len(sample) < 1 << 26:
            sample += text
    begun = time.process_time()
    for start in range(0, len(sample), 1 << 16):
        gzip.compress(sample[start : start + (1 << 16)], 1)
    took = time.process_time() - begun
    size = log.stat().st_size
    return {
        "raw_log_mb": round(size / 1e6, 1),
        "raw_log_as_text_mb": round(texts / 1e6, 1),
        "ratio": round(texts / size, 2),
        "compressed_mb_per_cpu_s": round(len(sample) / 1e6 / took, 1),
    }


def main() -> None:
    """Drive the session, print a line for each moment and the figures as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=120.0)
    parser.add_argument("--cycle", type=float, default=0.004)
    parser.add_argument("--keep", type=Path)
    arguments = parser.parse_args()
    rig = Rig.load("rx130l-joint3-simulated").model_copy(update={"cycle": arguments.cycle})
    seen: list[tuple[float, float, float]] = []
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.keep or Path(scratch) / "experiment"
        plan = back_and_forth(arguments.minutes)
        with PayloadSession(rig, folder, plan, rig.payload("none"), "benchmark") as session:
            session.check()
            session.confirm_payload(0.0)
            session.arm()
            processes = {
                "acquisition": session.processes.acquisition.pid,
                "recorder": session.processes.recorder.pid,
            }
            session.start()
            most = dict.fromkeys(processes, 0.0)
            while not session.wait(0.2).ended:
                progress = session.progress
                done = progress.cycle / max(1, progress.cycles)
                try:
                    now = {name: resident(process) for name, process in processes.items()}
                except (OSError, KeyError):
                    continue  # it ends
                most = {name: now[name][1] for name in now}
                if done >= (len(seen) + 1) / (MOMENTS + 1):
                    seen.append((done, now["acquisition"][0], now["recorder"][0]))
                    words = f"{done:4.0%}: acquisition {now['acquisition'][0]:.1f} MB, recorder {now['recorder'][0]:.1f} MB"
                    print(words, flush=True)
            if session.state is not SessionState.DONE or session.file is None:
                raise SystemExit(session.reason)
            figures = {
                "minutes": arguments.minutes,
                "cycle_s": arguments.cycle,
                "wall_s": round(time.monotonic() - begun),
                **{f"{name}_most_mb": round(value, 1) for name, value in most.items()},
                "hdf5_mb": round(session.file.stat().st_size / 1e6, 1),
                **compression(raw_log_of(session.file)),
            }
    print(json.dumps(figures))
    quarter = len(seen) // 4
    for column, name in ((1, "acquisition"), (2, "recorder")):
        early, late = (
            max(row[column] for row in seen[quarter : 2 * quarter]),
            max(row[column] for row in seen[-quarter:]),
        )
        if late > FLAT * early:
            raise SystemExit(
                f"the {name} grows: {early:.1f} MB in the second quarter, {late:.1f} MB in the last"
            )
    if figures["recorder_most_mb"] > LARGEST_RECORDER:
        raise SystemExit(f"the recorder takes more than {LARGEST_RECORDER:g} MB")


if __name__ == "__main__":
    main()

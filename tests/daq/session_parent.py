"""Run by tests as a process of its own: holds a session until it ends, and prints what happens.

session_parent.py FOLDER [RIG [AHEAD]]: AHEAD is a pickled `SentAhead` to be sent along the plan.
"""

import ctypes
import pickle
import signal
import sys
from pathlib import Path

from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from daq.session_workflow import PayloadSession

SECONDS = 300.0
"""of its standard plan"""


def gone(process: int) -> bool:
    """Whether a process that this script has started has ended."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def hold_interpreter(*_: object) -> None:
    """A C call that keeps the interpreter's lock: no thread of this process runs until it is killed."""
    ctypes.PyDLL(None).sleep(3600)


if __name__ == "__main__":
    signal.signal(signal.SIGUSR1, hold_interpreter)
    rig = Rig.load(sys.argv[2] if len(sys.argv) > 2 else "rx130l-joint3-simulated")
    plan = standard_plan(rig, SECONDS)
    ahead = pickle.loads(Path(sys.argv[3]).read_bytes()) if len(sys.argv) > 3 else None
    none = rig.payload("none")
    with PayloadSession(rig, Path(sys.argv[1]), plan, none, "operator", ahead=ahead) as session:
        check = session.check()
        if not check.ok:
            sys.exit(check.problems)
        session.confirm_payload(0.0)
        session.arm()
        print(session.processes.acquisition.pid, session.processes.recorder.pid, flush=True)
        session.start()
        while session.progress.cycle == 0 and not session.state.ended:
            session.wait(0.01)
        if not session.state.ended:
            print("moving", flush=True)
        print(session.wait().value, session.reason, flush=True)

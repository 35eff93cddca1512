"""Long work as jobs: queued, computed in processes, with progress and cancel."""

import logging
import math
import queue
import secrets
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import Any

from sqlalchemy import select, update

from api.computing import Computing
from api.service.database import LONGEST_WORDS, Database, JobRow
from api.service.job_documents import JobResult, JobState
from api.service.job_process import Arguments, JobProcess
from api.service.problems import Problem
from api.service.process_limits import ProcessLimits
from api.service.settings import ServiceSettings
from identify.results.document import Json

GRACE = 2.0
"""s that a cancelled computation has to stop by itself before its process is ended."""
POLL = 0.2
"""s between looks at whether a silent computation was cancelled."""
REMEMBERED = 200
"""Ended jobs kept in memory; older ones are read from the database."""
MOST_OF_A_USER, MOST = 10, 100
"""Jobs that one person, and all together, may have waiting and running."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """A snapshot of a job; a new one for every change.

    fraction : 0 to 1
    words    : what it is doing, or why it failed
    result   : what came of it
    """

    id: str
    kind: str
    experiment: str | None
    user: str
    state: JobState
    fraction: float
    words: str
    created: float
    ended: float | None = None
    result: JobResult = field(default_factory=JobResult)


@dataclass
class _Task:
    job: Job
    function: str
    arguments: Callable[[], Arguments]
    store: Callable[[Any], JobResult]
    repeated: bool = False
    clean_up: Callable[[], None] | None = None
    asked: object = None
    cancelled: threading.Event = field(default_factory=threading.Event)


Listener = Callable[[Job], None]


class JobRunner:
    """Runs jobs one after another, as many at the same time as `simultaneous` says, each in a process.

    computing : where each of them reduces its sessions
    limits    : what each of them may take of this computer
    shown     : words as people may see them

    Jobs of one experiment never overlap: each begins with what the one before has stored.
    """

    def __init__(
        self,
        database: Database,
        clock: Callable[[], float],
        simultaneous: int = 1,
        computing: Computing | None = None,
        limits: ProcessLimits | None = None,
        shown: Callable[[str], str] = str,
    ) -> None:
        self._computing = computing or Computing()
        self._limits = limits or ServiceSettings().job_limits
        self._shown = shown
        self._database = database
        self._clock = clock
        self._tasks: dict[str, _Task] = {}
        self._queue: queue.Queue[_Task | None] = queue.Queue()
        self._experiment_locks: dict[str | None, threading.Lock] = {}
        self._lock = threading.Lock()
        self._last_instant = -math.inf
        self._listeners: set[Listener] = set()
        self._threads = [
            threading.Thread(target=self._run, name=f"jobs-{n}", daemon=True) for n in range(simultaneous)
        ]
        self._mark_lost()

    def start(self) -> None:
        """Begin with the queue."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Cancel everything and wait for the processes to end."""
        for task in list(self._tasks.values()):
            task.cancelled.set()
        for _ in self._threads:
            self._queue.put(None)
        for thread in self._threads:
            if thread.is_alive():
                thread.join()

    def submit(
        self,
        kind: str,
        function: str,
        arguments: Callable[[], Arguments],
        store: Callable[[Any], JobResult],
        *,
        user: str,
        experiment: str | None,
        repeated: bool = False,
        clean_up: Callable[[], None] | None = None,
        asked: object = None,
        about: JobResult | None = None,
    ) -> Job:
        """Queue a computation.

        function  : `module:name`, see `JobProcess`
        arguments : called when the job's turn has come, so that it starts from what is stored then
        store     : takes the computation's result in this process, stores it and says what it became
        repeated  : follows by itself from what changed in an experiment, and starts from all that is stored when its turn
                    comes: one that waits serves for all changes so far, and it is not refused
        clean_up  : called once the process has ended whose arguments were asked for, whatever became of it
        asked     : what the user asked for, to be compared: asked twice, as by a double click, it is computed once, and the
                    job that has not ended yet is returned; None where each request counts
        about     : what the job's result names until there is one, so that a job that failed says what it was about

        Raises the problem 429 where the user, or all together, have as many jobs as they may.
        """
        job = Job(
            id=secrets.token_hex(8),
            kind=kind,
            experiment=experiment,
            user=user,
            state=JobState.QUEUED,
            fraction=0.0,
            words="waiting for its turn",
            created=self._instant(),
            result=about or JobResult(),
        )
        task = _Task(job, function, arguments, store, repeated, clean_up, asked)
        with self._lock:
            if repeated and (waiting := self._waiting_repeat(experiment)) is not None:
                return waiting
            if asked is not None and (same := self._unfinished_same(job, asked)) is not None:
                return same
            if not repeated:
                self._refuse_more(user)
            self._tasks[job.id] = task
            self._experiment_locks.setdefault(experiment, threading.Lock())
            self._forget_old()
        with self._database.transaction() as session:
            session.add(JobRow(**_row(job)))
        self._queue.put(task)
        return job

    def _instant(self) -> float:
        """The time, and later than that of the job before, so that the order of jobs is that of their times."""
        with self._lock:
            self._last_instant = max(self._clock(), math.nextafter(self._last_instant, math.inf))
            return self._last_instant

    def refuse_more(self, user: str, more: int = 1) -> None:
        """Raises the problem 429 where the user, or all together, would have more jobs than they may with `more` of them."""
        with self._lock:
            self._refuse_more(user, more)

    def _refuse_more(self, user: str, more: int = 1) -> None:
        users = [task.job.user for task in self._tasks.values() if not task.job.state.final]
        if users.count(user) + more > MOST_OF_A_USER:
            detail = f"{user} has {MOST_OF_A_USER} jobs waiting or running, which is the most; wait, or cancel one."
        elif len(users) + more > MOST:
            detail = f"{MOST} jobs are waiting or running, which is the most; try again when some are done."
        else:
            return
        raise Problem(429, detail, {"Retry-After": "60"})

    def get(self, identifier: str) -> Job | None:
        """The job with that id as it is now, also one from before a restart."""
        task = self._tasks.get(identifier)
        if task is not None:
            return task.job
        with self._database.transaction() as session:
            row = session.get(JobRow, identifier)
        return _job_of(row) if row else None

    def jobs(self, *, experiment: str | None = None, limit: int = 100) -> list[Job]:
        """The newest jobs first."""
        query = select(JobRow).order_by(JobRow.created.desc()).limit(limit)
        if experiment is not None:
            query = query.where(JobRow.experiment == experiment)
        with self._database.transaction() as session:
            rows = list(session.scalars(query))
        tasks = [self._tasks.get(row.id) for row in rows]
        return [task.job if task else _job_of(row) for task, row in zip(tasks, rows, strict=True)]

    def faults(self, experiment: str, kind: str, model: str) -> dict[JobResult, str]:
        """Why the newest jobs of a kind made nothing that are about a model version, by what else they are about (a format, a
        rig); only of those that made nothing, also from before a restart."""
        query = (
            select(JobRow)
            .where(JobRow.experiment == experiment, JobRow.kind == kind)
            .order_by(JobRow.created.desc())
        )
        newest: dict[JobResult, Job] = {}
        with self._database.transaction() as session:
            for row in session.scalars(query):
                job = _job_of(row)
                if job.result.model == model:
                    newest.setdefault(JobResult(format=job.result.format, rig=job.result.rig), job)
        made_nothing = (JobState.FAILED, JobState.LOST)
        return {about: job.words for about, job in newest.items() if job.state in made_nothing}

    def unfinished(self, experiment: str) -> list[Job]:
        """Jobs of an experiment that are not final, the one under way first."""
        with self._lock:
            jobs = [task.job for task in self._tasks.values()]
        return [job for job in jobs if job.experiment == experiment and not job.state.final]

    def unfinished_of(self, user: str, kind: str) -> Job | None:
        """The first job of a user that is of this kind and not final yet."""
        with self._lock:
            jobs = [task.job for task in self._tasks.values()]
        return next(
            (job for job in jobs if (job.user, job.kind) == (user, kind) and not job.state.final), None
        )

    def active(self, experiment: str) -> Job | None:
        """The first job of an experiment that is not final yet."""
        return next(iter(self.unfinished(experiment)), None)

    def cancel_kinds(self, experiment: str, kinds: Collection[str]) -> None:
        """Cancel every job of these kinds of an experiment that is not final yet."""
        with self._lock:
            tasks = list(self._tasks.values())
        for task in tasks:
            if task.job.experiment == experiment and task.job.kind in kinds and not task.job.state.final:
                task.cancelled.set()

    def cancel(self, identifier: str) -> Job:
        """Cancel a job. Raises the problem 404 for an unknown id and 409 for a job that has ended."""
        job = self.get(identifier)
        if job is None:
            raise Problem(404, f"No job has the id `{identifier}`.")
        if job.state.final:
            raise Problem(409, f"The job has ended already: {job.state}.")
        task = self._tasks[identifier]
        task.cancelled.set()
        return task.job

    def listen(self, listener: Listener) -> None:
        """Call `listener(job)` after every change, from a worker's thread; it must return at once."""
        self._listeners.add(listener)

    def unlisten(self, listener: Listener) -> None:
        """Call it no more."""
        self._listeners.discard(listener)

    # --- worker threads

    def _run(self) -> None:
        while (task := self._queue.get()) is not None:
            with self._experiment_locks[task.job.experiment]:
                try:
                    self._compute(task)
                except Exception as error:
                    _log.exception("job %s failed", task.job.id)
                    self._change(task, state=JobState.FAILED, words=f"{type(error).__name__}: {error}")

    def _compute(self, task: _Task) -> None:
        if task.cancelled.is_set():
            self._change(task, state=JobState.CANCELLED, words="cancelled before it began")
            return
        self._change(task, state=JobState.RUNNING, words="starting")
        try:
            ending = self._computed(task)
        finally:
            if task.clean_up is not None:
                task.clean_up()
        self._change(task, **ending)

    def _computed(self, task: _Task) -> Json:
        """Compute and store; what the job is then."""
        try:
            arguments = task.arguments()
        except Problem as problem:
            return {"state": JobState.FAILED, "words": problem.detail}
        process = JobProcess(task.function, arguments, self._limits, self._computing)
        try:
            kind, content = self._follow(task, process)
        finally:
            process.end()
        if kind == "result":
            return {"state": JobState.DONE, "fraction": 1.0, "words": "done", "result": task.store(content)}
        if kind == "cancelled":
            return {"state": JobState.CANCELLED, "words": "cancelled"}
        return {"state": JobState.FAILED, "words": content[1] if kind == "refused" else str(content)}

    def _waiting_repeat(self, experiment: str | None) -> Job | None:
        for task in self._tasks.values():
            same = task.repeated and task.job.experiment == experiment
            if same and task.job.state is JobState.QUEUED and not task.cancelled.is_set():
                return task.job
        return None

    def _unfinished_same(self, job: Job, asked: object) -> Job | None:
        whose = (job.user, job.kind, job.experiment)
        for task in self._tasks.values():
            theirs = (task.job.user, task.job.kind, task.job.experiment)
            under_way = not task.job.state.final and not task.cancelled.is_set()
            if under_way and theirs == whose and task.asked == asked:
                return task.job
        return None

    def _follow(self, task: _Task, process: JobProcess) -> tuple[str, Any]:
        """Pass progress on until the computation's last message."""
        deadline = None
        while True:
            if task.cancelled.is_set() and deadline is None:
                process.cancel()
                deadline = time.monotonic() + GRACE
            message = process.message(POLL)
            if message is not None and message[0] != "progress":
                return message
            if deadline is not None and time.monotonic() > deadline:
                return "cancelled", None
            if message is not None:
                fraction, step = message[1]
                self._change(task, fraction=min(max(fraction, 0.0), 1.0), words=step)

    def _change(self, task: _Task, **changes: Any) -> None:
        job = replace(task.job, **changes)
        job = replace(job, words=self._shown(job.words)[:LONGEST_WORDS])
        if job.state.final:
            job = replace(job, ended=self._clock())
        stored = job.state != task.job.state
        if stored:  # progress is of no use after a restart
            with self._database.transaction() as session:
                session.execute(update(JobRow).where(JobRow.id == job.id).values(**_row(job)))
        task.job = job
        for listener in list(self._listeners):
            listener(job)

    def _forget_old(self) -> None:
        ended = [task.job for task in self._tasks.values() if task.job.state.final]
        for job in sorted(ended, key=lambda job: job.created)[: max(0, len(ended) - REMEMBERED)]:
            del self._tasks[job.id]

    def _mark_lost(self) -> None:
        unfinished = [JobState.QUEUED, JobState.RUNNING]
        with self._database.transaction() as session:
            session.execute(
                update(JobRow)
                .where(JobRow.state.in_(unfinished))
                .values(
                    state=JobState.LOST,
                    words="the service was restarted before it ended",
                    ended=self._clock(),
                )
            )


def _row(job: Job) -> Json:
    return {**job.__dict__, "result": job.result.model_dump(mode="json", by_alias=True)}


def _job_of(row: JobRow) -> Job:
    return Job(
        id=row.id,
        kind=row.kind,
        experiment=row.experiment,
        user=row.user,
        state=JobState(row.state),
        fraction=row.fraction,
        words=row.words,
        created=row.created,
        ended=row.ended,
        result=JobResult.model_validate(row.result),
    )

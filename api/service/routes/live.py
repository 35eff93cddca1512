"""WebSockets: live samples of a rig, and the progress of a job."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

import anyio
from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from api.service import access
from api.service.job_documents import JobView
from api.service.jobs import Job
from api.service.live import Viewer

router = APIRouter(tags=["live"])

NO_SUCH = 4404
"""Close code for an id that nothing has; 4000 to 4999 are the application's own (RFC 6455)."""
SIGNED_OUT = 1008
"""Close code where the sign-in ended: policy violation (RFC 6455)."""
WELCOME_CHECKED_EVERY = 1.0
"""s between looks at whether who listens may still do so; commands of `coulomb users` in another process count too."""


@router.websocket("/rigs/{rig}/live")
async def rig_live(websocket: WebSocket, user: access.Viewer, rig: str) -> None:
    """Live samples of a rig: binary blocks (api/service/live.py) and, as text, the status as JSON.

    A connection that cannot take all blocks gets fewer.
    """
    service = access.service_of(websocket)
    if rig not in service.rigs.files():
        await websocket.close(NO_SUCH, "no such rig")
        return
    await websocket.accept()
    broadcast = service.live.broadcast(rig)
    viewer = broadcast.join()
    service.operators.watch_live(rig, user, +1)
    service.live.tell(rig)
    try:
        await _until_gone(websocket, lambda: _send_all(websocket, viewer))
    finally:
        broadcast.leave(viewer)
        service.operators.watch_live(rig, user, -1)
        service.live.tell(rig)


@router.websocket("/jobs/{job}/live")
async def job_live(websocket: WebSocket, _user: access.Viewer, job: str) -> None:
    """Progress of a job: its JSON on every change, the newest only; closed by the service when the job
    has ended.
    """
    jobs = access.service_of(websocket).jobs
    known = jobs.get(job)
    if known is None:
        await websocket.close(NO_SUCH, "no such job")
        return
    await websocket.accept()
    viewer, loop = Viewer(), asyncio.get_running_loop()

    def changed(snapshot: Job) -> None:
        if snapshot.id == job and not loop.is_closed():
            loop.call_soon_threadsafe(viewer.tell, JobView.model_validate(snapshot).model_dump_json())

    jobs.listen(changed)
    # Asked for after listening, so that no change falls between.
    viewer.tell(JobView.model_validate(jobs.get(job) or known).model_dump_json())

    async def send() -> None:
        while True:
            message = str(await viewer.next())
            await websocket.send_text(message)
            if JobView.model_validate_json(message).state.final:
                await websocket.close()
                return

    try:
        await _until_gone(websocket, send)
    finally:
        jobs.unlisten(changed)


async def _send_all(websocket: WebSocket, viewer: Viewer) -> None:
    while True:
        message = await viewer.next()
        # Waits while the connection's buffer is full; meanwhile the viewer's oldest blocks fall out.
        if isinstance(message, bytes):
            await websocket.send_bytes(message)
        else:
            await websocket.send_text(message)


async def _until_gone(websocket: WebSocket, send: Callable[[], Awaitable[None]]) -> None:
    """Run `send` until it ends, the other side is gone, or its sign-in has ended; what the other side says is not
    listened to."""
    async with anyio.create_task_group() as group:

        async def run(work: Callable[[], Awaitable[None]]) -> None:
            with contextlib.suppress(WebSocketDisconnect, RuntimeError):
                await work()
            group.cancel_scope.cancel()

        async def drain() -> None:
            while (await websocket.receive())["type"] != "websocket.disconnect":
                pass

        async def watch() -> None:
            while await access.still_welcome(websocket):
                await asyncio.sleep(WELCOME_CHECKED_EVERY)
            await websocket.close(SIGNED_OUT, "the sign-in has ended")

        group.start_soon(run, send)
        group.start_soon(run, watch)
        group.start_soon(run, drain)

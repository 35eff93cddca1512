"""What one running service holds, and how its parts are put together."""

from dataclasses import dataclass

from api.service.accounts import Accounts
from api.service.audit import AuditLog
from api.service.bus_claims import BusClaims
from api.service.confined_reader import ConfinedReader
from api.service.database import Database, open_database
from api.service.demos import Demos
from api.service.disk_budget import DiskBudget
from api.service.drive_resets import DriveResets
from api.service.drive_table_writings import DriveTableWritings
from api.service.drive_work import DriveWork
from api.service.expected_current import CurrentForecast
from api.service.experiment_store import ExperimentStore
from api.service.experiment_upload import Uploads
from api.service.homings import Homings
from api.service.jobs import JobRunner
from api.service.live_feed import LiveFeed
from api.service.model_use import ModelUse
from api.service.model_workflow import ModelWorkflow
from api.service.payload_sessions import PayloadSessions
from api.service.plan_store import PlanStore
from api.service.planner import Planner
from api.service.proofs import Proofs
from api.service.pulse import LoopPulse, StopReadiness
from api.service.rig_operators import RigOperators
from api.service.rig_stop import RigStop
from api.service.rig_store import RigStore
from api.service.separating_plans import SeparatingPlanner
from api.service.session_catalogue import SessionCatalogue
from api.service.session_facts import FileFacts
from api.service.session_samples import SessionSamples
from api.service.settings import ServiceSettings
from api.service.sign_in_throttle import SignInThrottle
from api.service.stop_log import StopLog
from api.service.stop_passes import StopPasses
from api.service.unlisted_recordings import UnlistedRecordings
from api.service.weighing import WeighingScale


@dataclass
class Service:
    """What one running service holds; routes reach it by `access.service_of`."""

    settings: ServiceSettings
    database: Database
    accounts: Accounts
    throttle: SignInThrottle
    audit: AuditLog
    experiments: ExperimentStore
    uploads: Uploads
    disk: DiskBudget
    jobs: JobRunner
    demos: Demos
    models: ModelWorkflow
    catalogue: SessionCatalogue
    model_use: ModelUse
    rigs: RigStore
    claims: BusClaims
    operators: RigOperators
    plans: PlanStore
    planner: Planner
    separating: SeparatingPlanner
    proofs: Proofs
    sessions: PayloadSessions
    unlisted_recordings: UnlistedRecordings
    homings: Homings
    drive_resets: DriveResets
    drive_tables: DriveTableWritings
    rig_stop: RigStop
    stop_passes: StopPasses
    stop_log: StopLog
    stop_readiness: StopReadiness
    loop_pulse: LoopPulse
    samples: SessionSamples
    live: LiveFeed
    scale: WeighingScale


def create_service(settings: ServiceSettings) -> Service:
    """A service on the data folder and database of its settings.

    Raises InputError if they cannot be used.
    """
    database = open_database(settings.data_folder, settings.database_url)
    clock = settings.clock
    audit = AuditLog(database, clock)
    experiments = ExperimentStore(database, settings.experiments_folder, clock)
    jobs = JobRunner(
        database,
        clock,
        settings.simultaneous_jobs,
        settings.computing,
        settings.job_limits,
        settings.without_folders,
    )
    models = ModelWorkflow(experiments, jobs)
    disk = DiskBudget(settings.data_folder, settings.disk_budget)
    rigs = RigStore(settings.data_folder / "rigs")
    claims = BusClaims()
    operators = RigOperators(claims, clock)
    plans = PlanStore(settings.data_folder / "plans")
    readiness = StopReadiness()
    proofs = Proofs(experiments, rigs, operators, claims, plans, jobs, clock)
    sessions = PayloadSessions(
        experiments, rigs, operators, claims, plans, models, proofs, audit, clock, readiness.could_stop_now
    )
    work = DriveWork(operators, claims, audit)
    homings = Homings(rigs, operators, claims, audit, readiness.could_stop_now)
    passes = StopPasses()
    return Service(
        settings=settings,
        database=database,
        accounts=Accounts(database, clock, passes.remember),
        throttle=SignInThrottle(clock),
        audit=audit,
        experiments=experiments,
        uploads=Uploads(experiments, ConfinedReader(settings.upload_limits), settings.unpacked_limit),
        disk=disk,
        jobs=jobs,
        demos=Demos(experiments, jobs, disk),
        models=models,
        catalogue=SessionCatalogue(experiments, models, FileFacts(ConfinedReader(settings.upload_limits))),
        model_use=ModelUse(experiments, jobs),
        rigs=rigs,
        claims=claims,
        operators=operators,
        plans=plans,
        planner=Planner(rigs, plans, jobs),
        separating=SeparatingPlanner(experiments, models, rigs, plans),
        proofs=proofs,
        sessions=sessions,
        unlisted_recordings=UnlistedRecordings(experiments, models, sessions),
        homings=homings,
        drive_resets=DriveResets(rigs, work),
        drive_tables=DriveTableWritings(experiments, rigs, work, jobs, clock),
        rig_stop=RigStop(sessions, homings),
        samples=SessionSamples(settings.data_folder / "looked-at", ConfinedReader(settings.upload_limits)),
        stop_passes=passes,
        stop_log=StopLog(audit, clock),
        stop_readiness=readiness,
        loop_pulse=LoopPulse(),
        live=LiveFeed(operators, sessions, settings.live_rate, CurrentForecast(experiments, rigs, plans).of),
        scale=WeighingScale(settings.scale_port),
    )

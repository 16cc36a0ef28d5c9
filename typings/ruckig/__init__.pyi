# Just the calls used. Arrays are lists with one entry a degree of freedom.
import enum
from collections.abc import Sequence
from typing import Literal, overload

class Bound:
    max: float
    min: float
    t_max: float
    t_min: float

class BrakeProfile:
    a: list[float]
    duration: float
    j: list[float]
    p: list[float]
    t: list[float]
    v: list[float]

class ControlInterface(enum.Enum):
    Position = ...
    Velocity = ...

class DurationDiscretization(enum.Enum):
    Continuous = ...
    Discrete = ...

class InputParameter:
    control_interface: ControlInterface
    current_acceleration: Sequence[float]
    current_position: Sequence[float]
    current_velocity: Sequence[float]
    degrees_of_freedom: int
    duration_discretization: DurationDiscretization
    max_acceleration: Sequence[float]
    max_jerk: Sequence[float]
    max_velocity: Sequence[float]
    min_acceleration: Sequence[float] | None
    min_velocity: Sequence[float] | None
    minimum_duration: float | None
    per_dof_synchronization: Sequence[Synchronization] | None
    synchronization: Synchronization
    target_acceleration: Sequence[float]
    target_position: Sequence[float]
    target_velocity: Sequence[float]
    def __init__(self, dofs: int) -> None: ...

class OutputParameter:
    new_acceleration: list[float]
    new_position: list[float]
    new_velocity: list[float]
    time: float
    trajectory: Trajectory
    def __init__(self, dofs: int) -> None: ...
    def pass_to_input(self, input: InputParameter) -> None: ...

class Profile:
    a: list[float]
    af: float
    brake: BrakeProfile
    j: list[float]
    p: list[float]
    pf: float
    t: list[float]
    v: list[float]
    vf: float

class Result(enum.IntEnum):
    Working = 0
    Finished = 1
    Error = -1
    ErrorInvalidInput = -100
    ErrorPositionalLimits = -102
    ErrorExecutionTimeCalculation = -110
    ErrorSynchronizationCalculation = -111

class Ruckig:
    @overload
    def __init__(self, dofs: int) -> None: ...
    @overload
    def __init__(self, dofs: int, delta_time: float) -> None: ...
    def calculate(self, input: InputParameter, trajectory: Trajectory) -> Result: ...
    def update(self, input: InputParameter, output: OutputParameter) -> Result: ...
    def validate_input(
        self,
        input: InputParameter,
        check_current_state_within_limits: bool = False,
        check_target_state_within_limits: bool = True,
    ) -> bool: ...

class RuckigError(Exception): ...

class Synchronization(enum.Enum):
    No = ...
    Phase = ...
    Time = ...
    TimeIfNecessary = ...

class Trajectory:
    duration: float
    independent_min_durations: list[float]
    position_extrema: list[Bound]
    profiles: list[list[Profile]]
    def __init__(self, dofs: int) -> None: ...
    @overload
    def at_time(
        self, time: float, return_section: Literal[False] = False
    ) -> tuple[list[float], list[float], list[float]]: ...
    @overload
    def at_time(
        self, time: float, return_section: Literal[True]
    ) -> tuple[list[float], list[float], list[float], int]: ...

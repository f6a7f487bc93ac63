# SPDX-License-Identifier: Apache-2.0
"""
Status of a tick of the control loop or of a solver.
"""
from __future__ import annotations
import typing
__all__: list[str] = ['Status', 'status_meanings']
class Status:
    """
    Result of one step of the control loop or of a solver. C++ and recordings use the same words.
    
    Members:
    
      Ok : the step was computed to its tolerance, without an error or limit
    
      MaxIterations : the solver of the load line used all its evaluations; the position is its best approximation
    
      NotUnique : the model's force falls too steeply; the equation of the virtual object may have a second solution
    
      NonFinite : the position or the force of the model was not a finite number; the force sent is zero
    
      Timeout : the device did not answer in time
    
      Lost : a sample of the device or a command to it was lost or repeated
    
      Fault : the device reported a fault or was disconnected; the force sent is zero
    
      Limited : the force was clipped to the force limit of host or device, or its change to the slew limit
    
      Jump : the position moved farther in one sample than the device can; the force sent is zero
    
      Frozen : the position stopped within one sample during fast motion and stayed constant; the force sent is zero
    
      Ramp : the force is scaled up from zero after the start
    
      EnergyLimited : a larger force could take the energy that the energy account still has; the force was limited
    
      LimitCycleScaled : a limit cycle was detected; all forces are scaled down until the end of the run
    
      Stale : the device applied a force computed from an older sample than the certificate allows; the force sent is zero
    
      Saturated : the force sensor of an admittance display was at the end of its range; the position is held
    """
    EnergyLimited: typing.ClassVar[Status]
    Fault: typing.ClassVar[Status]
    Frozen: typing.ClassVar[Status]
    Jump: typing.ClassVar[Status]
    LimitCycleScaled: typing.ClassVar[Status]
    Limited: typing.ClassVar[Status]
    Lost: typing.ClassVar[Status]
    MaxIterations: typing.ClassVar[Status]
    NonFinite: typing.ClassVar[Status]
    NotUnique: typing.ClassVar[Status]
    Ok: typing.ClassVar[Status]
    Ramp: typing.ClassVar[Status]
    Saturated: typing.ClassVar[Status]
    Stale: typing.ClassVar[Status]
    Timeout: typing.ClassVar[Status]
    __members__: typing.ClassVar[dict[str, Status]]
    @typing.overload
    def __eq__(self, other: Status) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Status) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
status_meanings: dict = {'Ok': 'the step was computed to its tolerance, without an error or limit', 'MaxIterations': 'the solver of the load line used all its evaluations; the position is its best approximation', 'NotUnique': "the model's force falls too steeply; the equation of the virtual object may have a second solution", 'NonFinite': 'the position or the force of the model was not a finite number; the force sent is zero', 'Timeout': 'the device did not answer in time', 'Lost': 'a sample of the device or a command to it was lost or repeated', 'Fault': 'the device reported a fault or was disconnected; the force sent is zero', 'Limited': 'the force was clipped to the force limit of host or device, or its change to the slew limit', 'Jump': 'the position moved farther in one sample than the device can; the force sent is zero', 'Frozen': 'the position stopped within one sample during fast motion and stayed constant; the force sent is zero', 'Ramp': 'the force is scaled up from zero after the start', 'EnergyLimited': 'a larger force could take the energy that the energy account still has; the force was limited', 'LimitCycleScaled': 'a limit cycle was detected; all forces are scaled down until the end of the run', 'Stale': 'the device applied a force computed from an older sample than the certificate allows; the force sent is zero', 'Saturated': 'the force sensor of an admittance display was at the end of its range; the position is held'}

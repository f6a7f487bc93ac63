# SPDX-License-Identifier: Apache-2.0
"""Findings on an identified model: error on the rows, size, and force that the inputs cannot explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ...recording import Recording
from ...recording.checks import findings_of
from ...recording.motion import noise_band, strokes_from_order, turns_of
from ...recording.roles import counts_text, role_counts
from ...verdict import Finding, Verdict, force_jnd, no, usable
from ..data.limits import neighbour_correlation
from ..data.rows import Rows, modulo, period_notes
from ..data.strokes import weights_of_shared_errors
from ..log import Decision, Log, causes_of_crossing, latest, not_tested, shifted_strokes
from ..network.constraints import COMPARED_POSITIONS
from ..network.fitted import Errors, FittedNetwork
from ..options import IdentifyOptions
from ..search.evidence import Candidate, RowError
from .causes import MOST_JND, PLACE_ERRORS, Judged, means_at, places_of
from .class_selection import VELOCITY_INPUTS, ClassSelection
from .repeatability import band_with_check, left_out_residual
from .shift import shift_of

USABLE_NRMSE = 0.1
"""NRMSE above which a model is usable with a reservation: the RMS error is then a tenth of the standard
deviation of the force [-]."""

UNFIT_NRMSE = 0.5
"""NRMSE above which a model is unfit: it leaves a quarter of the force's variance unexplained [-]."""


def error_findings(nrmse: float, rows: str, cure: str = "") -> list[Finding]:
    """Returns findings on the size of the NRMSE; `rows` names the rows on which the NRMSE was computed, and
    `cure` is a sentence."""
    if nrmse <= USABLE_NRMSE:
        return []
    judge = no if nrmse > UNFIT_NRMSE else usable
    explained = max(0.0, 1.0 - nrmse * nrmse)
    return [
        judge(
            f"the NRMSE on {rows} is {nrmse:.3g}, a good model has at most {USABLE_NRMSE:g}: the model "
            f"explains {explained:.0%} of the variance of the force{cure}"
        )
    ]


def error_text(nrmse: float, settled: float, rows: str) -> str:
    """Returns the statement of an error: the NRMSE of all rows, each of them whole, and the NRMSE that the
    verdict uses if it differs."""
    text = f"NRMSE {nrmse:.4g} on {rows}"
    if f"{settled:.2g}" != f"{nrmse:.2g}":
        text += f", {settled:.4g} if rows that wait or in which friction reverses share one error"
    return text


def verdict_of(
    network: FittedNetwork,
    recordings: Sequence[Recording],
    side: Float1D | None = None,
    attracts: bool = False,
) -> Verdict:
    """Returns the verdict on an identified network; `side` (n,) is the direction of all rows, and `attracts`
    is True if the object is stated to attract the tool."""
    fitted, left_out = network.errors.settled_nrmse
    moving = network.damping is not None or network.memory is not None or "velocity" in network.inputs
    explained = moving and max(fitted, left_out) <= UNFIT_NRMSE
    recorded = findings_of(recordings, side, attracts, explained)
    if any(each.level == "no" for each in recorded):  # this cause of an error hides the others
        return Verdict(tuple(dict.fromkeys(recorded)))
    findings = [*recorded, *network.log.findings]
    rows = "rows that were left out of the fit" if left_out > fitted else "the rows of the identification"
    cure = ""
    if not network.log.findings and fitted <= USABLE_NRMSE:
        cure = ". The rows are too far apart to show the force between them: record more rows per stroke"
    elif not network.log.findings:
        timed = all(each.time is not None for each in recordings)
        directed = all(each.direction is not None for each in recordings)
        more = _more_inputs(timed, directed)
        cure = f". The force has noise or depends on more than {_inputs(network)}: {more}"
    findings += error_findings(max(fitted, left_out), rows, cure)
    return Verdict(tuple(dict.fromkeys(findings)))


def _inputs(network: FittedNetwork) -> str:
    """Returns what the force of a network depends on, in words."""
    directed = ["direction"] if network.weight_hysteresis is not None else []
    moving = ["velocity"] if network.damping is not None else []
    relaxing = ["time"] if network.memory is not None else []
    return " and ".join([*network.inputs, *directed, *moving, *relaxing])


def _more_inputs(timed: bool, directed: bool) -> str:
    """Returns the cure for a force that depends on more than the inputs of the model; it names only columns
    that are not recorded yet."""
    missing = (
        ["further inputs"] if timed else ["time", *([] if directed else ["direction"]), "further inputs"]
    )
    return f"record {' or '.join(missing)} as columns, and identify different objects or places separately"


def wait_findings(best: Candidate, left: NDArray[np.bool_]) -> list[Finding]:
    """Returns a finding if the force at rows that are not fitted differs much from the model.

    Between press and release any force is possible, and a position within its noise. At rows that are `left`
    (n,), outside a domain whose end the tool leaves, the force is at most that inside. Relaxation, creep and
    drift are named only if the force of most rows differs from that of the first of successive rows: the last
    one can be the first of the next stroke.
    """
    data = best.data
    unused = np.flatnonzero(~data.fitted)
    if not len(unused) or best.error.spread == 0.0:
        return []
    box, force, band = data.box[unused], best.static_force[unused], noise_band(data.path[:, 0])
    parts = [best.parts_at(near) for near in (np.clip(box + shift, 0.0, 1.0) for shift in (0.0, -band, band))]
    # At an end of the travel the force beyond is not known: it changes there as much as inside.
    (middle, half), (before, _), (behind, _) = parts
    around = np.abs(half) + np.maximum(np.abs(before - middle), np.abs(behind - middle))
    low, high = middle - around, middle + around
    low, high = np.where(left[unused], (low.clip(max=0.0), high.clip(min=0.0)), (low, high))
    outside = np.maximum(force - high, low - force).clip(min=0.0)
    error = float(np.sqrt(np.mean(outside**2)))
    if error <= USABLE_NRMSE * best.error.spread:
        return []
    begins = np.diff(unused, prepend=-2) > 1
    change = float(np.median(np.abs(force - force[begins][np.cumsum(begins) - 1])))
    reason = f"from the first row of each wait on it changes by {data.force_unit.text(change)}"
    if 2.0 * change > error:
        timed = data.parts or data.names == VELOCITY_INPUTS
        record = "" if timed else "record time, so that a memory can be identified, or "
        reason += (
            " (relaxation, creep or drift), which a model of position does not show. Cure: "
            f"{record}use the model only while the tool moves"
        )
    counts = counts_text(role_counts(data.roles[unused]))
    return [
        usable(
            f"in {len(force)} rows that are not fitted ({counts}) the force differs from the model by "
            f"{data.force_unit.text(error)} RMS; {reason}"
        )
    ]


def judged_candidate(best: Candidate, passive: bool = False) -> Judged:
    """Returns an accepted candidate; `passive` is True if its hysteresis h must not be below 0."""
    height = None if best.side is None else lambda box: best.parts_at(box)[1]
    inputs = _inputs(best.network)
    return Judged(best.data, best.residual, best.settled.weight, best.side, inputs, height, passive)


def judged_network(network: FittedNetwork, rows: Rows) -> Judged:
    """Returns an identified network that has a residual on all rows."""
    weight = rows.fitted * network.errors.share
    return Judged(rows, network.errors.residual, weight, rows.direction, _inputs(network))


def place_findings(best: Judged) -> list[Finding]:
    """Returns a finding on the place at which the mean force of the rows differs most from the model, if a
    hand feels the difference. A place is one of the travel: the repeats of a periodic force can differ."""
    rows = np.flatnonzero(best.weight > 0.0)
    if len(best.data.names) > 1 or not len(rows):
        return []
    data, residual, weight = best.data, best.residual[rows], best.weight[rows]
    group = places_of(data.along[rows], None if best.side is None else best.side[rows])
    mean, force, square = means_at(group, weight, residual, data.force[rows], residual**2)
    count, places = np.bincount(group, weight, len(mean)), len(mean) // 2
    error = np.sqrt(np.maximum(square - mean**2, 0.0) / np.maximum(count - 1.0, 1.0))
    jnd = force_jnd(force, best.floor or 1.0)
    noticed = np.where(count > 2, (np.abs(mean) - PLACE_ERRORS * error) / jnd, 0.0)
    worst = int(np.argmax(noticed))
    if noticed[worst] <= MOST_JND:
        return []
    stroke = "" if best.side is None else (" of the release" if worst >= places else " of the press")
    middle, unit = (worst % places + 0.5) / places, data.force_unit
    if data.period is not None:
        middle = float(data.path.min() + np.ptp(data.path) * middle)
    box = middle if data.period is None else float(modulo(np.array([middle]))[0])
    more = _more_inputs(bool(data.parts), data.side is not None)
    reason = (
        f"the force there depends on more than {best.inputs}, such as earlier motion{best.pinched}: {more}"
    )
    if data.period is not None:
        reason = (
            "the repeats of the force differ, or its zero moved. For a force that does not repeat give "
            "--inputs position,hysteresis"
        )
    if best.hysteresis is not None and best.passive:
        loop = (
            2.0 * best.hysteresis(np.array([[box]]))[0] + mean[worst % places] - mean[worst % places + places]
        )
        if loop < 0.0:
            reason = (
                f"release is {unit.text(-float(loop))} above press, which the model excludes; "
                f"{causes_of_crossing(bool(data.parts))}"
            )
    return [
        usable(
            f"at {data.position_unit.text(float(data.lower[0] + data.reach[0] * middle))}{stroke} the rows "
            f"differ from the model by {unit.text(abs(float(mean[worst])))} on average, "
            f"{noticed[worst]:.2g} just noticeable differences: {reason}"
        )
    ]


def effect_of_shift(selection: ClassSelection) -> tuple[float, list[Finding], list[str]]:
    """Returns the RMS change of a model without the shift of press against release that the rows show,
    divided by the standard deviation of the force [-], and a finding; a note if a hand does not feel it.

    The change is that at the places and directions of the rows. It is 0 without such a shift, or if it is
    less than the error on the rows.
    """
    best = selection.best
    if (shift := selection.once(shift_of)) is None:
        return 0.0, [], []
    data, unit, weight = best.data, best.data.force_unit, best.settled.weight
    box, side = data.box, np.zeros(len(weight)) if best.strokes is None else best.strokes.side
    (middle, half), (true_middle, true_half) = (each.parts_at(box) for each in (best, shift.without))
    force = true_middle + side * true_half
    place = places_of(box, side)
    mean_apart, mean_force = means_at(place, weight, middle + side * half - force, force)
    worst = float(np.max(np.abs(mean_apart) / force_jnd(mean_force, judged_candidate(best).floor or 1.0)))
    rms = float(np.sqrt(np.mean(mean_apart[np.unique(place[weight > 0.0])] ** 2)))
    spread, explained = best.error.spread or 1.0, 2.0 * shift.without.rmse**2 <= shift.before**2
    perceptible = max(rms, best.settled.rmse * explained) > USABLE_NRMSE * spread or worst > MOST_JND
    if not perceptible and rms < best.error.rmse:
        return 0.0, [], []
    amount, lag_s = data.position_unit.text(shift.amount * float(data.reach[0])), None
    if shift.late and explained:
        amount, lag_s = f"a force that is about {1e3 * shift.amount:.3g} ms late", shift.amount
    elif shift.late:  # the lag is not the only cause of the error, and its correction can raise it
        amount = "a late force"
    causes = shifted_strokes(bool(data.parts), lag_s)
    sentence = (
        f"press and release are shifted against each other, by {amount}: without it the RMS error falls from "
        f"{unit.interval(shift.before, shift.without.rmse)}, and the model changes by {unit.text(rms)} RMS, "
        f"at one place by {worst:.2g} just noticeable differences; {causes}"
    )
    if perceptible:
        return rms / spread, [usable(sentence)], []
    return rms / spread, [], [f"P{sentence[1:]}."]


def energy_findings(best: Candidate) -> list[Finding]:
    """Returns a finding if a force of position and velocity gains energy: on average over a place, the force
    of a press is below that of a release at the same speed, and a hand feels the difference."""
    data, rows = best.data, np.flatnonzero(best.error.weight > 0.0)
    if data.names != VELOCITY_INPUTS or not len(rows):
        return []
    there, back = data.positions[rows], data.positions[rows] * (1.0, -1.0)
    known = np.abs(there[:, 1]) <= min(data.positions[rows, 1].max(), -data.positions[rows, 1].min())
    there, back = there[known], back[known]
    loop = np.sign(there[:, 1]) * (best.network.force(there, None) - best.network.force(back, None))
    place = places_of(data.box[rows][known], None)
    mean, force = means_at(place, np.ones(len(place)), loop, data.force[rows][known])
    gained = -mean / force_jnd(force, judged_candidate(best).floor or 1.0)
    worst = int(np.argmax(gained))
    if gained[worst] <= MOST_JND:
        return []
    position = data.position_unit.text(
        float(data.lower[0] + data.reach[0] * (worst + 0.5) / (len(mean) // 2))
    )
    return [
        usable(
            f"at {position} the force of a release is {data.force_unit.text(-float(mean[worst]))} above that "
            "of a press at the same speed; a passive object cannot do that. A stroke has another zero or the "
            f"wrong sign, or {shifted_strokes(True)}"
        )
    ]


def drift_findings(best: Judged) -> list[Finding]:
    """Returns a finding if strokes in the same direction over the same place differ by more than a just
    noticeable difference. One press and release cannot show this."""
    return [usable(best.cause.sentence)] if best.cause is not None and best.cause.perceptible else []


def _outside(best: Candidate, options: IdentifyOptions, into: float) -> tuple[str, float]:
    """Returns the continuation below the domain for `into` = 1, above it for -1, and the distance [box] from
    the end of the travel to the domain.

    An object that is pressed towards smaller positions, with forces below zero, is the mirror image of one
    that is pressed towards larger positions. One that is stated to attract the tool is not pressed so.
    """
    data, choice = best.data, options.below if into > 0.0 else options.above
    if into < 0.0 and choice == "auto" and options.below == "linear":
        choice = "linear"
    if choice != "auto":
        return choice, 0.0
    near_zero = options.search.contact_share * float(np.ptp(best.static_force[data.reported]))
    held = len(data.names) > 1 or data.period is not None
    if held or _pulls(best, max(best.rmse, near_zero), into):
        return "linear", 0.0
    return "free", _first_contact(best, near_zero, into)


def _pulls(best: Candidate, near_zero: float, into: float) -> bool:
    """Returns True if the object, which is pressed in the direction `into`, pulls the tool in more than one
    row of each press, or of each release, that passes the place of the pull. A zero that moves, or one stroke
    with the wrong sign, shows a pull that other strokes do not show."""
    data, rows = best.data, np.flatnonzero(best.data.reported)
    direction = strokes_from_order(data.path[rows, 0]) if data.side is None else data.side[rows]
    box, pulled = data.box[rows, 0], into * best.static_force[rows] < -near_zero
    if direction is None or not direction.any():
        return bool(np.count_nonzero(pulled) > 1)
    starts = np.flatnonzero(np.diff(direction, prepend=np.nan))
    in_stroke = np.add.reduceat(pulled.astype(np.intp), starts) > 1
    first, last = np.minimum.reduceat(box, starts), np.maximum.reduceat(box, starts)
    for way in np.unique(direction[pulled & (direction != 0)]):
        place = np.median(box[pulled & (direction == way)])
        if in_stroke[(direction[starts] == way) & (first <= place) & (place <= last)].all():
            return True
    return False


def _first_contact(best: Candidate, near_zero: float, into: float) -> float:
    """Returns the distance [box] from the end of the travel to the domain of a force that the tool can leave:
    0, or the end of a pull that no row shows. Between few rows before the contact a network can pull; its
    continuation does not. It starts where both strokes are free: the rows before it have no force."""
    data = best.data
    box = data.box[data.fitted & (into * best.static_force > near_zero), 0]
    reached = float((box if into > 0.0 else 1.0 - box).min()) if len(box) else 0.0
    way = np.linspace(0.0, reached, COMPARED_POSITIONS)
    middle, half = best.parts_at((way if into > 0.0 else 1.0 - way)[:, None])
    least, most = into * middle - np.abs(half), into * middle + np.abs(half)
    if least.min() >= -judged_candidate(best).floor:
        return 0.0
    end = min(int(np.flatnonzero(least < 0.0)[-1]) + 1, COMPARED_POSITIONS - 1)
    return float(way[end]) if most[end] <= max(best.rmse, near_zero) else 0.0


def limit_findings(best: Candidate, judged: Judged, limit: int) -> list[Finding]:
    """Returns a finding if growth ended at `limit` wavelets although neighbouring residuals are still
    correlated, and a hand feels the error."""
    if best.stop_reason != "max_wavelets" or not best.problem.structured(best.solution):
        return []
    if best.error.rmse <= judged.floor and not place_findings(judged):
        return []
    return [
        usable(
            f"the network has {limit} wavelets, the largest number allowed, and the error (NRMSE "
            f"{best.error.nrmse:.3g}) is not yet noise; give --max-wavelets {4 * limit}"
        )
    ]


def hidden_by_friction(best: Candidate, decisions: Sequence[Decision]) -> list[Decision]:
    """Returns the decision that the faults of a measurement are not tested which the rows do not distinguish
    from friction; none without friction. `decisions` holds the other ones."""
    data = best.data
    if best.strokes is None or len(data.names) > 1:
        return []
    direction = strokes_from_order(data.path[:, 0])
    one_speed = not data.parts or not_tested("damping", decisions)
    cures = {"backlash": "mount the object without it"}
    if direction is None or turns_of(direction) < 2:
        cures["a moved zero"] = "press a second time"
    if one_speed:
        cures["a late force"] = (
            f"record {'' if data.parts else 'the time, '}slow and fast strokes of many rows"
        )
    cure = f"the loop of friction hides {', '.join(cures)}; {', '.join(cures.values())}"
    return [Decision("measuring faults", "not tested", cure)]


def _judged_error(best: Candidate, contact_share: float) -> RowError:
    """Returns the error that the verdict uses, as a verification computes it: rows behind turns share an
    error that is left there. A play radius states how friction reverses, so that these rows count whole."""
    error, data = best.error, best.data
    if best.strokes is None or best.strokes.weight is None or best.play_radius is not None:
        return error
    assert data.order is not None
    order = data.order * data.fitted
    weight = weights_of_shared_errors(data.path[:, 0], order, best.residual, data.force, contact_share)
    return replace(error, weight=error.weight * weight)


def identified(selection: ClassSelection) -> FittedNetwork:
    """Returns the accepted network in the units of the recording, with its error on the rows, all notes and
    findings."""
    best, log, options = selection.best, selection.log, selection.options
    data, error, network = best.data, best.error, best.network
    notes, findings = list(data.log.notes), list(data.log.findings)
    decisions, replaced = latest([*log.decisions, *data.log.decisions])
    if data.period is not None:
        positions = data.lower[0] + data.reach[0] * data.path[:, 0]
        note, of_period = period_notes(positions, data.period, data.position_unit.si)
        notes, findings = [*notes, note], findings + of_period
    settled = _judged_error(best, options.search.contact_share)
    (below, first), (above, last) = (_outside(best, options, into) for into in (1.0, -1.0))
    box = data.box[:, 0]
    left = ((box < first) & (below == "free")) | ((box > 1.0 - last) & (above == "free"))
    findings += wait_findings(best, left)
    judged = judged_candidate(best, options.hysteresis_nonnegative)
    # One cause of an error hides the others.
    shift_nrmse, of_shift, remarks = effect_of_shift(selection)
    decisions += hidden_by_friction(best, decisions)
    findings += (
        of_shift
        or log.findings
        or energy_findings(best)
        or limit_findings(best, judged, options.max_wavelets)
        or drift_findings(judged)
        or place_findings(judged)
    )
    left_out = selection.once(left_out_residual)
    if f"{settled.nrmse:.2g}" != f"{error.nrmse:.2g}":
        notes.append(
            "Rows behind turns share an error, because friction reverses there, and count less in the fit: "
            f"NRMSE {error.nrmse:.2g} on all rows, {settled.nrmse:.2g} with these weights."
        )
    band, checked = band_with_check(selection)
    return replace(
        network,
        below=below,
        above=above,
        lower=network.lower + data.reach * first,
        upper=network.upper - data.reach * last,
        errors=Errors(
            rmse=error.rmse,
            nrmse=error.nrmse,
            left_out_nrmse=replace(error, residual=left_out).nrmse,
            settled_nrmse=(settled.nrmse, replace(settled, residual=left_out).nrmse),
            rows=int(np.count_nonzero(error.weight)),
            correlation=neighbour_correlation(
                best.residual[(best.error_on(None).weight > 0.0) | ~data.fitted]
            ),
            residual=best.residual,
            share=np.where(data.fitted, best.share, 1.0),
        ),
        shift_nrmse=shift_nrmse,
        band=band,
        log=Log(
            log.path,
            decisions,
            data.log.rows + log.rows,
            [*notes, *log.notes, *(f"Replaced decision: {each}." for each in replaced)],
            findings,
        ),
        remarks=(*remarks, *checked),
    )

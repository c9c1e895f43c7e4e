"""The commands about prints: appraise them by photographs or a scan, and simulate them from their program."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, final

import typer

from geoprint.cli.bounds import limit_memory, watch
from geoprint.cli.ending import wrote
from geoprint.cli.options import AsJson, MaxMemory, Overwrite
from geoprint.cli.terminal import columns, result, say
from geoprint.errors import UsageError, how_many

if TYPE_CHECKING:
    from geoprint.inspection.appraise_photographs import PlanAsked
    from geoprint.reporting.records.inspection import AppraisalRecord, LyingRecord, ScanAppraisalRecord
    from geoprint.reporting.records.rounding import Record


Files = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILES",
        help=(
            "Photographs of prints (JPEG, PNG, TIFF or BMP); several from one fixed camera are also compared. Or one "
            "scan: a cloud (.ply, .xyz, .pwn, .txt, .pts, .csv) or a mesh."
        ),
        show_default=False,
    ),
]
Bundle = Annotated[
    Path | None,
    typer.Option("--plan", metavar="FOLDER", help="Bundle of the plan that was printed.", show_default=False),
]
FiducialTables = Annotated[
    list[Path] | None,
    typer.Option(
        "--fiducials",
        metavar="FILE",
        help="Table of points in the photograph: name,u,v,x,y,z in pixels and mm; once for all, or once for each.",
        show_default="the part's outline places the camera",
    ),
]
Lenses = Annotated[
    list[Path] | None,
    typer.Option(
        "--lens",
        metavar="FILE",
        help="Lens of the camera: a .toml file, or at least three photographs of a checkerboard, one option each.",
        show_default=False,
    ),
]
Corners = Annotated[
    str | None, typer.Option(metavar="NxM", help="Inner corners of the checkerboard, as 9x6.", show_default=False)
]
Reach = Annotated[
    float | None,
    typer.Option(
        metavar="MM", help="Largest distance of material from its run.", show_default="half the spacing of the plan"
    ),
]
Width = Annotated[
    float | None,
    typer.Option(metavar="PX", help="Width of beads in pixels.", show_default="the one of the highest contrast"),
]
Threshold = Annotated[
    float | None,
    typer.Option(
        "--threshold",
        metavar="RATIO",
        help="Least contrast of a bead, over the spread of the grey values around it.",
        show_default="Otsu's",
    ),
]
PartFile = Annotated[
    Path | None,
    typer.Option("--part", metavar="FILE", help="With --before: the part as its file has it.", show_default=False),
]
Before = Annotated[
    bool, typer.Option("--before", help="The scan, or touched points, are of the part before it is printed on.")
]
PoseTable = Annotated[
    Path | None,
    typer.Option(
        "--pose",
        metavar="FILE",
        help="Pose of the scan in the part's coordinates: x,y,z,q1,q2,q3,q4, up to 10 mm and 5 degrees off.",
        show_default="the scan stands in these",
    ),
]
Features = Annotated[bool, typer.Option("--features", help="The scan may lie anywhere: match features of the part.")]
ScanUnit = Annotated[
    str | None,
    typer.Option("--scan-unit", metavar="mm|cm|m|um|in", help="Of the scan's coordinates.", show_default="mm"),
]
PartUnit = Annotated[
    str | None,
    typer.Option(
        "--unit", metavar="mm|cm|m|um|in", help="Of the file of --part, where it does not say it.", show_default=False
    ),
]
MostOffset = Annotated[
    float | None,
    typer.Option("--most", metavar="MM", help="Largest distance of the part from its file.", show_default="2"),
]
OutOrNone = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Also write pictures, tables and appraisal.json there.", show_default=False),
]


@final
class BeadShade(StrEnum):
    """What beads are, beside what they lie on."""

    LIGHTER = "lighter"
    DARKER = "darker"


def appraise(
    files: Files,
    *,
    plan: Bundle = None,
    fiducials: FiducialTables = None,
    lens: Lenses = None,
    corners: Corners = None,
    reach: Reach = None,
    shade: Annotated[
        BeadShade, typer.Option(metavar="lighter|darker", help="What beads are, beside what they lie on.")
    ] = BeadShade.LIGHTER,
    width: Width = None,
    contrast: Threshold = None,
    pose: PoseTable = None,
    features: Features = False,
    scan_unit: ScanUnit = None,
    before: Before = False,
    part: PartFile = None,
    unit: PartUnit = None,
    most: MostOffset = None,
    out: OutOrNone = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Appraise prints by photographs or a scan of them: what came out, beside the plan; or a part before its print."""
    from geoprint.inspection.appraise_photographs import PlanAsked
    from geoprint.postprocessor import check_writable

    seen = {"--fiducials": fiducials, "--lens": lens, "--corners": corners, "--reach": reach}
    pictured = {**seen, "--width": width, "--threshold": contrast}
    scanned = {"--pose": pose, "--features": features, "--scan-unit": scan_unit}
    lying = {"--before": before, "--part": part, "--unit": unit, "--most": most}
    kind = _kind(files, before=before)
    limit_memory(max_memory)
    if out is not None:
        check_writable(out, overwrite=overwrite)
    if kind == "photographs":
        _refuse({**scanned, **lying}, "is for a scan, and these are photographs")
        _refuse(seen if plan is None else {}, "needs `--plan`, which places the part")
        asked = None if plan is None else PlanAsked(plan, tuple(fiducials or ()), tuple(lens or ()), corners, reach)
        record, text = _of_photographs(files, asked, (shade.value, width, contrast), out=out, overwrite=overwrite)
    else:
        _refuse({**pictured, **(lying if kind == "print" else {"--plan": plan})}, f"is not for a scan of a {kind}")
        how = (scan_unit or "mm", pose, features)
        if kind == "print":
            record, text = _of_print(files[0], plan, how, out=out, overwrite=overwrite)
        else:
            record, text = _of_part(files[0], (part, unit, most), how, out=out, overwrite=overwrite)
    _tell(record, text, plan=plan if len(files) == 1 else None, out=out, as_json=as_json)


def _tell(record: Record, text: str, *, plan: Path | None = None, out: Path | None, as_json: bool) -> None:
    from geoprint.reporting import as_json as json_of
    from geoprint.reporting.prints import next_print
    from geoprint.reporting.records.inspection import AppraisalRecord, ScanAppraisalRecord

    result(text, lambda: json_of(record), as_json=as_json)
    if out is not None:
        wrote(out, "written and verified")
    if plan is not None and isinstance(record, AppraisalRecord | ScanAppraisalRecord):
        say(next_print(record, plan=str(plan), folder=None if out is None else str(out)))


def _kind(files: list[Path], *, before: bool) -> Literal["photographs", "print", "part"]:
    """Return what was given: photographs, a scan of a print, or one of a part before its print."""
    from geoprint.inspection.scan import is_scan

    scans = [path for path in files if is_scan(path.name)]
    if scans and len(files) > 1:
        raise UsageError(
            f"`{scans[0].name}` is a scan: one is appraised at a time, alone; found {how_many(len(files), 'file')}."
        )
    if before:
        return "part"
    return "print" if scans else "photographs"


def _refuse(options: Mapping[str, object], why: str) -> None:
    """Refuse the first option that was given."""
    for flag, value in options.items():
        if value:
            raise UsageError(f"`{flag}` {why}.")


def _of_photographs(
    files: list[Path],
    asked: PlanAsked | None,
    beads: tuple[Literal["lighter", "darker"], float | None, float | None],
    *,
    out: Path | None,
    overwrite: bool,
) -> tuple[AppraisalRecord, str]:
    from geoprint.inspection.appraise_photographs import appraise_photographs
    from geoprint.inspection.records import record_appraisal
    from geoprint.inspection.text import appraisal_text

    shade, width, contrast = beads
    with watch() as observe:
        found = appraise_photographs(
            files, against=asked, shade=shade, width=width, threshold=contrast, observe=observe
        )
        observe("writing")
        _save(found, out, overwrite=overwrite)
    record = record_appraisal(found)
    return record, appraisal_text(record, width=columns())


def _of_print(
    scan: Path, plan: Path | None, how: tuple[str, Path | None, bool], *, out: Path | None, overwrite: bool
) -> tuple[ScanAppraisalRecord, str]:
    from geoprint.inspection.appraise_scans import ScanAsked, appraise_scan
    from geoprint.inspection.records import record_scan
    from geoprint.inspection.text import scan_text

    if plan is None:
        raise UsageError(
            f"`{scan.name}` is a scan: give `--plan`, the bundle of its print, or `--part` with `--before` where "
            "nothing is printed yet."
        )
    with watch() as observe:
        found = appraise_scan(scan, bundle=plan, asked=ScanAsked(*how), observe=observe)
        observe("writing")
        _save(found, out, overwrite=overwrite)
    record = record_scan(found)
    return record, scan_text(record, width=columns())


def _of_part(
    scan: Path,
    lying: tuple[Path | None, str | None, float | None],
    how: tuple[str, Path | None, bool],
    *,
    out: Path | None,
    overwrite: bool,
) -> tuple[LyingRecord, str]:
    from geoprint.inspection.appraise_scans import MOST_OFFSET, ScanAsked, scan_before
    from geoprint.inspection.records import record_lying
    from geoprint.inspection.text import lying_text

    part, unit, most = lying
    if part is None:
        raise UsageError("`--before` needs `--part`, the file of the part that lies there.")
    with watch() as observe:
        found = scan_before(
            scan, part=part, part_unit=unit, asked=ScanAsked(*how), most=MOST_OFFSET if most is None else most,
            observe=observe,
        )  # fmt: skip
        observe("writing")
        _save(found, out, overwrite=overwrite)
    record = record_lying(found)
    return record, lying_text(record)


def _save(found: object, out: Path | None, *, overwrite: bool) -> None:
    """Write a result where that is asked for."""
    from geoprint.workflow import save

    if out is not None:
        save(found, out, overwrite=overwrite)


# Simulation of a print.


SimulatedBundle = Annotated[
    Path, typer.Argument(help="Folder that `geoprint plan` or `compare` wrote.", show_default=False)
]
Spread = Annotated[
    float,
    typer.Option(metavar="RATIO", help="Width of beads over that of their flow; below 1 they are separate."),
]
Flow = Annotated[
    float,
    typer.Option(
        metavar="RATIO", help="Volume that flows, over that of the plan; 1 over the viscosity if that differs."
    ),
]
WidthNoise = Annotated[
    float, typer.Option(metavar="RATIO", help="Standard deviation of the width along a bead, over its mean.")
]
Offset = Annotated[float, typer.Option(metavar="MM", help="By which all beads lie to the left of their paths.")]
Tone = Annotated[
    str, typer.Option(metavar="GAMMA", help="Tone curve of the photograph: its gamma, 1 for none, or srgb.")
]
Exposure = Annotated[
    float, typer.Option(metavar="RATIO", help="Of the photograph: what comes to more than white is cut off.")
]
Blur = Annotated[float, typer.Option(metavar="PX", help="Of the photograph (standard deviation).")]
Defocus = Annotated[float, typer.Option(metavar="PX", help="Of the photograph: the circle that a point is seen as.")]
RandomSeed = Annotated[int, typer.Option(min=0, metavar="N", help="Of all noise.")]
SimulationOut = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        help="Also write simulated.json, and a scan and a photograph for `geoprint appraise`.",
        show_default=False,
    ),
]


def simulate(
    bundle: SimulatedBundle,
    *,
    flow: Flow = 1.0,
    spread: Spread = 1.0,
    noise: WidthNoise = 0.0,
    offset: Offset = 0.0,
    tone: Tone = "1",
    exposure: Exposure = 1.0,
    blur: Blur = 0.7,
    defocus: Defocus = 0.0,
    seed: RandomSeed = 0,
    out: SimulationOut = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Simulate the print of a bundle: execute its program as it stands, and deposit what it commands, run by run."""
    from geoprint.inspection.simulated import record_simulated, simulated_print, simulated_text
    from geoprint.postprocessor import check_writable
    from geoprint.simulation import Development, Faults

    limit_memory(max_memory)
    if out is not None:
        check_writable(out, overwrite=overwrite)
    faults = Faults(offset=offset, width_scale=spread, width_noise=noise, flow=flow)
    development = Development(exposure=exposure, tone=_gamma(tone), blur=blur, defocus=defocus)
    with watch("program") as observe:
        found = simulated_print(bundle, faults=faults, seed=seed, development=development)
        observe("writing")
        _save(found, out, overwrite=overwrite)
    record = record_simulated(found)
    _tell(record, simulated_text(record), out=out, as_json=as_json)


def _gamma(tone: str) -> float:
    """Return the gamma of a tone curve, 0 for sRGB's."""
    if tone.strip().lower() == "srgb":
        return 0.0
    try:
        gamma = float(tone)
    except ValueError:
        gamma = 0.0
    if not 0.2 <= gamma <= 5.0:
        raise UsageError(f"`--tone {tone}`: it must be a gamma from 0.2 to 5, or srgb.")
    return gamma

"""The page of a stack says what its record says, also of one that nobody can judge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.config import Job, job_of, load_cell
from geoprint.layers import FinishedStack, StackedLayer, middle_planes, sliced, sliced_layer
from geoprint.layers.records import FinishedFlowsRecord, StackedLayerRecord, StackRecord
from geoprint.layers.stack_page import stack_page
from geoprint.layers.stack_text import finished_record, stack_text, with_cure
from geoprint.layers.stack_thickness import column_feet, finished
from geoprint.model import Cell, Flood, Fluid, Material, Surface
from tests.meshes import plate
from tests.metrics.deposits import deposited, straight_line
from tests.reporting.test_report_page import Reader

HEIGHT, COUNT = 0.4, 500


def made(*, met: bool = False, leaving: int = 0) -> FinishedStack:
    """Return two layers on a plate, the upper one with nine tenths of its flow on one half, if that is constant.

    So many columns leave through a side below the upper one.
    """
    part = plate((20.0, 10.0), (20, 10))
    feet, planes = column_feet(part, count=COUNT), middle_planes(part, np.eye(3))
    full = np.full((2, COUNT), HEIGHT)
    less = full * np.where(np.arange(2)[:, None] + (feet.places[:, 0] < 10.0) == 1, 0.9, 1.0)
    layers = [
        _layer(part, number, deposited, met=met, leaving=leaving) for number, deposited in enumerate((full, less))
    ]
    bottoms = np.array([0.0, HEIGHT])
    wanted = np.full(COUNT, 2 * HEIGHT)
    return FinishedStack(
        base=part,
        inputs=(("plate.ply", 64 * "a"),),
        upright=np.eye(3),
        planes=planes,
        ground=tuple(sliced(part, plane) for plane in planes),
        feet=feet,
        wanted=wanted,
        layers=tuple(layers),
        flows=tuple(
            finished(
                np.stack(deposited),
                wanted,
                met=np.full((2, COUNT), met),
                within=np.stack([each.within for each in layers]),
                bottoms=bottoms,
                height=HEIGHT,
            )
            for deposited in zip(*(layer.deposited for layer in layers), strict=True)
        ),
        printed=0,
    )


def _layer(
    part: Surface,
    number: int,
    deposited_there: np.ndarray[tuple[int, int], np.dtype[np.float64]],
    *,
    met: bool,
    leaving: int,
) -> StackedLayer:
    level = Surface(part.vertices + np.array([0.0, 0.0, (number + 0.5) * HEIGHT]), part.faces, "level")
    stream = deposited([straight_line((0.0, y + number), (20.0, y + number)) for y in (1.0, 3.0, 5.0, 7.0)], range(4))
    return StackedLayer(
        bottom=number * HEIGHT,
        height=HEIGHT,
        spacing=2.0,
        deposited=deposited_there,
        printed=0,
        met=np.full(COUNT, met),
        within=np.arange(COUNT) >= number * leaving,
        volumes=deposited_there.mean(axis=1) * 200.0,
        slices=tuple(sliced_layer(level, stream, plane, height=HEIGHT) for plane in middle_planes(part, np.eye(3))),
        places=stream.surface_points,
        offsets=101 * np.arange(5),
    )


def record_of(stack: FinishedStack) -> StackRecord:
    layers = tuple(
        StackedLayerRecord(
            folder=f"layer-0{number}", bottom_mm=layer.bottom, height_mm=layer.height, area_mm2=200.0, runs=4,
            deposit_mm=80.0, gap=0.0, overlap=0.0, thickness_cv=0.02, speed_mm_s=20.0, laid_mm3=layer.volumes[0],
            wanted_mm3=80.0, print_s=None, clearance_mm=None, not_printable=None, warnings=("mind this",),
            not_checked=("hoses",),
        )
        for number, layer in enumerate(stack.layers, start=1)
    )  # fmt: skip
    return StackRecord(
        schema=3, version="0", part="plate.ply", thickness_mm=0.8, target=None, target_mm3=None,
        finished=finished_record(stack, wanted=160.0), layers=layers, program=None, left_out=(),
    )  # fmt: skip


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    path = tmp_path_factory.mktemp("part") / "plate.ply"
    path.touch()
    return job_of(surface=path, unit="mm", spacing=2.0, thickness=0.8, robot=False)


@pytest.fixture(scope="module")
def written(job: Job) -> bytes:
    stack = made()
    return stack_page(stack, record_of(stack), job)


def test_the_page_says_what_the_record_says(written: bytes) -> None:
    record = record_of(made())
    assert record.finished.constant_flow is not None
    assert record.finished.following_flow is not None
    # One half has 1.9 of 2 layers.
    assert record.finished.constant_flow.mean == pytest.approx(0.975, abs=1e-3)
    assert record.finished.constant_flow.volume == pytest.approx(0.975, abs=1e-3)
    assert record.finished.following_flow.cv == record.finished.constant_flow.cv
    assert record.finished.printed == record.finished.constant_flow
    text = " ".join(Reader(written).text.split())
    for said in (
        "Finished thickness 97.5 % of the target, varies by 2.56 %", "Warning: mind this", "Not checked: hoses.",
        "seams apart [mm]", "1.00", "Cut across through the middle", "plate.ply", 64 * "a",
    ):  # fmt: skip
        assert said in text, said
    # Without a robot there is no time and no clearance.
    assert "time [s]" not in text
    assert "varies by 2.56 %" in stack_text(record)


def test_of_columns_that_leave_through_a_side_the_share_is_told(job: Job) -> None:
    record = record_of(made(leaving=50))
    assert record.finished.printed is not None
    assert (record.finished.printed.judged, record.finished.printed.under_sides) == (1.0, 0.1)
    said = "udged up to overhanging sides: 10.0 % of the area"
    assert said in stack_text(record)
    assert said in Reader(stack_page(made(leaving=50), record, job)).text
    assert "sides" not in stack_text(record_of(made()))


def test_a_stack_that_nobody_can_judge_has_its_page_all_the_same(job: Job) -> None:
    stack = made(met=True)
    record = record_of(stack)
    assert record.finished.printed is None
    assert "finished thickness" not in stack_text(record)
    text = " ".join(Reader(stack_page(stack, record, job)).text.split())
    assert "plate.ply: 0.8 mm in 2 layers" in text
    assert "nothing measured" in text


def test_the_page_is_the_same_again_and_another_of_another_stack(job: Job, written: bytes) -> None:
    stack = made()
    assert written == stack_page(stack, record_of(stack), job)
    halved = replace(stack, layers=(stack.layers[0], replace(stack.layers[1], places=0.5 * stack.layers[1].places)))
    assert written != stack_page(halved, record_of(halved), job)


def test_the_page_names_the_cause_of_the_thickest_place(job: Job) -> None:
    plain = made()
    middle = int(np.argmin(np.linalg.norm(plain.feet.places - [10.0, 5.0, 0.0], axis=1)))
    for first, said in ((2.0, "in 2 runs lie closer together than 0.8 spacings"), (1.0, "show no cause")):
        layers: list[StackedLayer] = []
        for layer in plain.layers:
            deposited = np.full_like(layer.deposited, layer.height)
            deposited[:, middle] *= 1.5
            # Two rows a spacing apart beside the place, and with the first at 2 mm only half of one.
            rows = [np.linspace((0.0, y, layer.bottom + 0.2), (20.0, y, layer.bottom + 0.2), 101) for y in
                    (first + 2.0, 5.0, 9.0)]  # fmt: skip
            layers.append(replace(layer, deposited=deposited, places=np.concatenate(rows), offsets=101 * np.arange(4)))
        flow = finished(
            np.stack([each.deposited[0] for each in layers]), plain.wanted,
            met=np.stack([np.zeros(COUNT, dtype=np.bool_)] * len(layers)),
            within=np.stack([np.ones(COUNT, dtype=np.bool_)] * len(layers)),
            bottoms=np.array([each.bottom for each in layers]), height=HEIGHT,
        )  # fmt: skip
        stack = replace(plain, layers=tuple(layers), flows=(flow, flow))
        text = " ".join(Reader(stack_page(stack, record_of(stack), job)).text.split())
        assert "with 150.0 % of the target: 2 of 2 layers deposit more than 105 % of their height there" in text
        assert said in text, first


# What is said of the cure of a stack: doses at the bottoms of its layers, who lacks light, and what nobody knows.


SILICONE = Material(1.1, Fluid(20.0, 0.6), irradiance=100.0, spot_diameter=6.0, dose=100.0, penetration=0.5)


def _cell(material: Material | None = SILICONE, flood: Flood | None = None) -> Cell:
    return replace(load_cell(None), material=material, flood=flood)


def _stack(dose: float | None, *, count: int = 3, target_mm3: float | None = None) -> StackRecord:
    layers = tuple(
        StackedLayerRecord(
            folder=f"layer-{number:02}", bottom_mm=0.5 * (number - 1), height_mm=0.5, area_mm2=100.0, runs=4,
            deposit_mm=80.0, gap=0.0, overlap=0.0, thickness_cv=None, speed_mm_s=20.0, laid_mm3=50.0, wanted_mm3=50.0,
            print_s=None, clearance_mm=None, not_printable=None, dose_mj_cm2=dose, warnings=(), not_checked=(),
        )
        for number in range(1, count + 1)
    )  # fmt: skip
    return StackRecord(
        schema=3, version="0", part="a.ply", thickness_mm=0.5 * count, target=None, target_mm3=target_mm3,
        finished=FinishedFlowsRecord(constant_flow=None, following_flow=None, printed=None), layers=layers,
        program=None, left_out=(),
    )  # fmt: skip


def test_layers_that_lack_light_are_named_with_what_they_get_need_and_what_to_do() -> None:
    record = with_cure(_stack(200.0), _cell())
    assert record.cure is not None
    assert (record.cure.needed_mj_cm2, record.cure.penetration_mm, record.cure.speed_mm_s) == (100.0, 0.5, 20.0)
    doses = [layer.cure.whole_mj_cm2 for layer in record.layers if layer.cure is not None]
    np.testing.assert_allclose(doses, 200.0 * np.cumsum(np.exp([-1.0, -2.0, -3.0]))[::-1])
    text = stack_text(record)
    assert "missed 0.00 %, 73.6 then 111 mJ/cm2 at its bottom" in text
    assert (
        "warning: layer 3 is not cured through: at its bottom all passes give 73.6 of 100 mJ/cm2: print at up to 14.7 "
        "mm/s, with layers up to 0.35 mm high, or name a final exposure ([flood])."
    ) in text
    assert (
        "note: layers 1, 2 are soft at the bottom until the layers above are cured: their own passes give 73.6 of 100"
    ) in text
    # As slow as that, and as thin as that, the highest layer gets what it needs.
    slower = with_cure(_stack(200.0 * 20.0 / 14.7), _cell())
    assert "not cured through" not in stack_text(slower)


def test_a_stack_with_light_enough_is_not_warned_of() -> None:
    text = stack_text(with_cure(_stack(300.0), _cell()))
    assert "cured" not in text
    assert "soft" not in text


def test_within_a_target_a_layer_may_be_the_topmost_and_its_own_passes_must_do() -> None:
    text = stack_text(with_cure(_stack(200.0, target_mm3=140.0).model_copy(update={"target": "lens.stl"}), _cell()))
    assert "layers 1, 2, 3 are not cured through: at the bottom of layer 1 its own passes give, where it is" in text
    assert "soft" not in text


def test_the_final_exposure_is_named_and_not_counted() -> None:
    text = stack_text(with_cure(_stack(50.0), _cell(flood=Flood(60.0))))
    assert "print at up to 3.68 mm/s, or rely on the final exposure of 60 s, which is not counted" in text


@pytest.mark.parametrize(
    ("material", "lacking"),
    [
        (None, "uv_irradiance_mw_cm2, uv_spot_mm, uv_dose_mj_cm2, uv_penetration_mm"),
        (replace(SILICONE, penetration=None), "needs uv_penetration_mm"),
        (replace(SILICONE, irradiance=None, spot_diameter=None), "needs uv_irradiance_mw_cm2, uv_spot_mm"),
    ],
)
def test_what_nobody_knows_of_the_light_is_said_as_not_checked(material: Material | None, lacking: str) -> None:
    known = material is not None and material.irradiance is not None
    record = with_cure(_stack(200.0 if known else None), _cell(material))
    assert record.cure is None
    assert f"{lacking}" in stack_text(record, verbose=True).split("not checked: curing through the layers")[1]

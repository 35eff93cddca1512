"""What each effect's picture shows of an error that is known, as numbers."""

from dataclasses import replace

import numpy as np
import pytest

from api.pages.effect_pictures import effect_pictures
from api.pages.error_figures import JointUnits
from api.pages.joint_samples import JointSamples

TURNS, SLIDES = JointUnits.of("revolute"), JointUnits.of("prismatic")
PERIOD = 0.02
SWING = 8.0  # s


def swinging(error) -> JointSamples:
    """A joint that swings for 64 s, each way in 4 s, and what a model without load leaves: `error` of the samples."""
    time = np.arange(0.0, 64.0, PERIOD)
    rate = 2 * np.pi / SWING
    position = 1.2 * np.sin(rate * time)
    velocity = 1.2 * rate * np.cos(rate * time)
    samples = JointSamples(
        files=("session-00.h5",),
        session=np.zeros(len(time), int),
        time=time,
        position=position,
        velocity=velocity,
        acceleration=-(rate**2) * position,
        load=10.0 * position,
        measured=np.zeros(len(time)),
        predicted=np.zeros(len(time)),
        moving=np.ones(len(time), bool),
        temperature=np.full(len(time), np.nan),
    )
    return replace(samples, measured=error(samples))


def pictures(effect, samples, after=None, units=TURNS, **constants):
    return effect_pictures(effect, samples, after, units, None, constants)


@pytest.mark.parametrize(("units", "way", "mark"), [(TURNS, "331 mrad", "19.0"), (SLIDES, "331 mm", "3.02")])
def test_a_wave_is_folded_on_ten_degrees_each_and_stands_out_among_the_wave_numbers(units, way, mark):
    ripple = swinging(lambda samples: 2.0 * np.sin(19.0 * samples.position))
    gone = replace(ripple, predicted=ripple.measured)
    folded, spectrum, worst = pictures("torque-ripple", ripple, gone, units, wave_number=19.0)
    assert folded.variable == f"position within one period of {way}"
    assert (folded.unit, folded.turned, folded.low) == ("°", False, False)
    np.testing.assert_allclose(folded.before.centre, np.arange(5.0, 360.0, 10.0))
    np.testing.assert_allclose(folded.before.median, 2.0 * np.sin(np.radians(folded.before.centre)), atol=0.1)
    np.testing.assert_array_equal(folded.after.median, 0.0)

    with_wave, without = spectrum.curves
    unit = 1.0 if units is TURNS else 2 * np.pi
    assert (with_wave.kind, without.kind) == ("before", "")
    assert len(with_wave.x) == 301
    assert with_wave.x[-1] == pytest.approx(38.0 / unit)
    assert with_wave.x[0] == pytest.approx(2 * np.pi * 2.5 / 2.4 / unit, rel=1e-3)  # 2.5 waves over the range
    assert spectrum.at == [(19.0 / unit, mark)]
    assert with_wave.x[np.argmax(with_wave.y)] == pytest.approx(19.0 / unit, rel=0.02)
    assert with_wave.y.max() == pytest.approx(2.0, rel=0.1)
    np.testing.assert_array_equal(without.y, 0.0)
    assert spectrum.x_label == ("waves per turn of the joint" if units is TURNS else "waves per metre")
    assert spectrum.y_label == f"amplitude, {units.load}"
    assert (spectrum.low, spectrum.torque) == (True, False)
    assert worst.quantity == ("torque" if units is TURNS else "force")


def test_a_long_wave_is_shown_from_half_its_number():
    wave = swinging(lambda samples: np.sin(2.0 * samples.position))
    _, spectrum, _ = pictures("torque-ripple", wave, wave_number=2.0)
    (curve,) = spectrum.curves
    assert (curve.x[0], curve.x[-1]) == pytest.approx((1.0, 4.0))


def driven_by_its_load(samples):
    return samples.load * samples.velocity < 0


def test_the_loss_is_apart_for_who_drives_and_slow_samples_are_left_out():
    def loss(samples):
        size = np.where(driven_by_its_load(samples), 5.0, 2.0) * np.abs(samples.load) / 12.0
        slow = samples.speed < 0.1 * samples.speed.max()
        return np.where(slow, 100.0, size) * np.sign(samples.velocity)

    motor, by_load, _ = pictures("load-friction", swinging(loss), swinging(lambda samples: samples.time))
    for picture, slope in ((motor, 2.0 / 12.0), (by_load, 5.0 / 12.0)):
        assert (picture.turned, picture.low, picture.unit) == (True, True, "N m")
        assert picture.words.endswith(", above 10\u202f% of the greatest speed")
        band = picture.before
        known = np.isfinite(band.median)
        assert len(band.centre) == 24
        assert band.centre[0] == pytest.approx((band.centre[1] - band.centre[0]) / 2, rel=0.02)
        np.testing.assert_allclose(band.median[known], slope * band.centre[known], atol=0.1)
        assert np.nanmax(band.high) < 6.0
        assert np.isfinite(picture.after.median).any()
    assert "motor drives" in motor.words
    assert "load drives" in by_load.words


def test_slow_samples_count_where_most_are():
    def mostly_slow(samples):
        return np.sign(samples.velocity)

    samples = swinging(mostly_slow)
    crawling = np.where(samples.time < 60.0, 0.05, 1.0)
    samples = replace(samples, velocity=samples.velocity * crawling)
    motor, by_load, _ = pictures("load-friction", samples)
    for picture in (motor, by_load):
        assert picture.words.endswith(")")
        known = np.isfinite(picture.before.median)
        assert known.sum() > 20
        np.testing.assert_allclose(picture.before.median[known], 1.0)
        assert picture.after is None


@pytest.mark.parametrize(("units", "small"), [(TURNS, "mrad"), (SLIDES, "mm")])
def test_a_loop_goes_forward_from_the_left_and_comes_back_from_the_right(units, small):
    loop = swinging(lambda samples: np.sign(samples.velocity) * (1.0 + samples.travel))
    picture, _ = pictures("presliding", loop, units=units, presliding_distance=0.05)
    forward, backward = picture.curves
    assert picture.x_label == f"travel since the reversal, {small}: forward →, ← backward"
    width = 8.0 * 50.0 / 24  # of an interval, of eight presliding distances
    np.testing.assert_allclose(forward.x, width * (np.arange(24) + 0.5))
    np.testing.assert_allclose(backward.x, forward.x[::-1])
    for curve, travelled, direction in ((forward, forward.x, 1), (backward, 400.0 - backward.x, -1)):
        known = np.isfinite(curve.y)
        assert known.sum() >= 20
        np.testing.assert_allclose(
            curve.y[known], direction * (1.0 + 1e-3 * travelled[known]), atol=1e-3 * width
        )
    unknown, _ = pictures("presliding", loop, loop)
    assert [curve.kind for curve in unknown.curves] == ["before", "before", "", ""]
    assert unknown.curves[0].x[-1] == pytest.approx(1e3 * np.median(loop.travel) * 47 / 48)


def test_around_a_reversal_time_runs_three_tenths_of_the_mean_time_between_them_to_either_side():
    friction = swinging(lambda samples: 3.0 * np.sign(samples.velocity))
    half = replace(friction, predicted=0.5 * friction.measured)
    alone, _ = pictures("delay", half)
    both, _ = pictures("delay", half, replace(friction, predicted=friction.measured))
    assert [curve.kind for curve in alone.curves] == ["measured", "predicted"]
    assert [curve.kind for curve in both.curves] == ["measured", "before", "predicted"]
    measured, before, after = both.curves
    assert len(measured.x) == 48
    step = measured.x[1] - measured.x[0]
    assert measured.x[-1] + step / 2 == pytest.approx(0.3 * 4.0)  # 16 reversals in 64 s
    away = np.abs(measured.x) > 2 * PERIOD
    np.testing.assert_allclose(measured.y[away], 3.0 * np.sign(measured.x[away]), atol=1e-9)
    np.testing.assert_allclose(before.y[away], 1.5 * np.sign(measured.x[away]), atol=1e-9)
    np.testing.assert_allclose(after.y, measured.y)
    assert both.at == [(0.0, "reversal")]
    assert both.y_label == "torque · direction after it, N m"
    assert (both.torque, both.resting) == (True, None)


def test_the_range_in_which_the_joint_mostly_rests_reaches_to_the_edges_of_its_intervals():
    friction = swinging(lambda samples: 3.0 * np.sign(samples.velocity))
    picture, _ = pictures("delay", replace(friction, moving=friction.speed > 0.2))
    # 0.2 = 1.2 (2π/8)² t about a reversal: at rest within 0.27 s to either side
    measured = picture.curves[0]
    step = measured.x[1] - measured.x[0]
    low, high = picture.resting
    assert (low, high) == pytest.approx((-0.27, 0.27), abs=step)
    np.testing.assert_allclose(
        (np.array([low, high]) - measured.x[0] + step / 2) / step % 1 % 1, 0, atol=1e-6
    )


def test_the_worst_stretch_is_six_seconds_about_the_greatest_error():
    error = swinging(lambda samples: np.where(np.abs(samples.time - 30.0) < 2.0, 1.0, 0.1))
    *_, worst = pictures("delay", error)
    seconds = worst.rows.seconds
    assert worst.words == "Torque where the error is worst, session-00.h5"
    assert seconds[-1] - seconds[0] == pytest.approx(6.0, abs=2 * PERIOD)
    assert seconds[0] <= 28.1
    assert seconds[-1] >= 31.9
    assert worst.rows.without is None
    # compared with the model before only where both are of the same samples
    *_, both = pictures("delay", error, replace(error, predicted=0.25 * error.measured))
    np.testing.assert_allclose(both.rows.without, 0.0)
    np.testing.assert_allclose(both.rows.error, 0.75 * both.rows.error_without)
    fewer = error.where(np.arange(len(error.time)) < 3000)
    *_, apart = pictures("delay", error, fewer)
    assert apart.rows.without is None


def test_over_a_variable_both_bands_have_the_same_intervals():
    """Loss grows with time: the error is turned by the direction."""
    warm = swinging(lambda samples: (1.0 + samples.time) * np.sign(samples.velocity))
    picture, _ = pictures("friction-warmup", warm, replace(warm, predicted=0.5 * warm.measured), SLIDES)
    assert (picture.words, picture.unit, picture.turned) == ("Residual over time", "s", True)
    width = picture.before.centre[1] - picture.before.centre[0]
    np.testing.assert_allclose(picture.before.median, 1.0 + picture.before.centre, atol=0.2 * width)
    np.testing.assert_allclose(picture.after.median, 0.5 * picture.before.median)
    np.testing.assert_array_equal(picture.after.centre, picture.before.centre)
    temperature, _ = pictures("friction-temperature", replace(warm, temperature=20.0 + warm.time))
    assert (temperature.variable, temperature.unit) == ("temperature", "°C")

import numpy as np
import pytest
from scipy.interpolate import BSpline

from hzmp_planners._arrays import Floats
from hzmp_tracking.spline import Spline


@pytest.fixture
def curve() -> tuple[Floats, Floats]:
    rng = np.random.default_rng(3)
    return rng.normal(size=(10, 2)), rng.uniform(0.2, 1.0, 7)


def test_pieces_are_the_b_spline_of_scipy(curve: tuple[Floats, Floats]) -> None:
    c, d = curve
    knots = np.concatenate([np.zeros(4), np.cumsum(d), np.full(3, d.sum())])
    reference = BSpline(knots, c, 3)
    starts = np.concatenate([[0.0], np.cumsum(d)[:-1]])
    for piece, start, h in zip(Spline(c, d).coefficients(), starts, d, strict=True):
        s = np.linspace(0.0, h, 7)
        ours = np.vander(s, 4, increasing=True) @ piece
        assert np.allclose(ours, reference(start + s), atol=1e-12)


def test_the_curve_lies_in_the_hull_of_its_bezier_points(curve: tuple[Floats, Floats]) -> None:
    c, d = curve
    spline = Spline(c, d)
    starts = np.concatenate([c[:1], spline.knots.value, c[-1:]])
    for i, piece in enumerate(spline.coefficients()):
        points = [starts[i], spline.left.value[i], spline.right.value[i], starts[i + 1]]
        s = np.linspace(0.0, 1.0, 11)
        weights = [(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3]
        bezier = sum(w[:, None] * p for w, p in zip(weights, points, strict=True))
        assert np.allclose(bezier, np.vander(s * d[i], 4, increasing=True) @ piece, atol=1e-12)


@pytest.mark.parametrize(
    "name", ["V", "A", "left", "right", "knots", "change_1", "change_2", "change_3"]
)
def test_jacobians_are_those_of_central_differences(
    curve: tuple[Floats, Floats], name: str
) -> None:
    c, d = curve
    rng = np.random.default_rng(4)
    dc, dd, eps = rng.normal(size=c.shape), rng.normal(size=d.shape), 1e-6
    plus = getattr(Spline(c + eps * dc, d + eps * dd), name).value
    minus = getattr(Spline(c - eps * dc, d - eps * dd), name).value
    entry = getattr(Spline(c, d), name)
    around_c = np.vstack([dc, np.zeros((4, 2))])
    around_d = np.concatenate([[0.0, 0.0], dd, np.zeros(5)])
    for i, numeric in enumerate((plus - minus) / (2 * eps)):
        by_c = entry.by_c[i] @ around_c[i : i + 4]
        by_d = around_d[i : i + 5] @ entry.by_d[i]
        assert by_c + by_d == pytest.approx(numeric, rel=1e-5, abs=1e-5)

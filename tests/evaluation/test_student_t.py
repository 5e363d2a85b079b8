import pytest
from scipy import stats

from benchbot.evaluation import student_t


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 5, 9, 24, 101])
@pytest.mark.parametrize("p", [0.001, 0.025, 0.2, 0.5, 0.8, 0.975, 0.9995])
def test_quantiles_are_those_of_scipy(p: float, degrees: int) -> None:
    assert student_t.quantile(p, degrees) == pytest.approx(stats.t.ppf(p, degrees), rel=1e-9, abs=1e-9)
    assert student_t.probability(student_t.quantile(p, degrees), degrees) == pytest.approx(p, abs=1e-12)

"""How `make bench` processes the output of its programs: the JSON, the baseline, the table, the agreement of peers."""

import copy
import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "bench"))

import images  # noqa: E402
from baseline import BOUNDS, grown, judge  # noqa: E402
from table import INDEXES, table  # noqa: E402

TARGETS = ("m3", "m4f", "m7", "r5f", "host")
PEERS = ("casadi", "eigen_qr", "eigen_svd", "pinocchio")
STAGES = {
    "none": ("motion", "observer", "index", "explained", "bank", "detector"),
    "guard_tick": ("receive", "tick"),
}


def printed(mean: int = 1000, worst: int = 1500) -> list[list[str]]:
    """Lines as the counting programs print them."""
    lines = []
    for case in (*images.CASES, *INDEXES, *(f"{index}_one" for index in INDEXES)):
        lines += [f"count {case} {stage} {mean} {worst} 10000" for stage in STAGES.get(case, STAGES["none"])]
        lines += [f"count {case} total {mean} {worst} 10000", f"deficient {case} 77"]
    lines += ["size guard_bytes 3216", "size permitted_ticks 9990", "size painted_stack_bytes 944"]
    return [line.split() for line in lines]


def counted(mean: int = 1000, worst: int = 1500) -> images.Counts:
    result: images.Counts = {}
    images.read_counts(printed(mean, worst), result)
    return result | {"flash_bytes": 24543, "stack_bytes": 944}


def baseline_of(counts: images.Counts, compiler: str = "gcc 12.2.0") -> images.Counts:
    return {"m4f": {"float": counts}, "about": {"system": "debian 12", "compilers": {"m4f": compiler}}}


def test_every_case_has_mean_worst_and_stages() -> None:
    counts = counted(1000, 1500)
    for case in images.CASES:
        assert counts[case]["mean"] == 1000
        assert counts[case]["worst"] == 1500
        assert counts[case]["states"] == 10000
        assert counts[case]["rank_deficient"] == 77
        assert tuple(counts[case]["stages"]) == STAGES.get(case, STAGES["none"])
        assert all(stage == {"mean": 1000, "worst": 1500} for stage in counts[case]["stages"].values())
    assert counts["guard_bytes"] == 3216


def test_a_line_that_no_counting_program_prints_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="HARD FAULT"):
        images.read_counts([["HARD", "FAULT"]], {})


def test_growth_of_one_percent_passes_and_of_more_does_not() -> None:
    before = counted(1000, 1500)
    assert grown(counted(1010, 1515), before, "m4f.float") == []
    found = grown(counted(1011, 1515), before, "m4f.float")
    assert "m4f.float.none.mean: 1011, the baseline is 1000" in found
    assert not any("worst" in line for line in found)


@pytest.mark.parametrize("size", images.SIZES)
def test_flash_memory_and_stack_that_grow_do_not_pass(size: str) -> None:
    before, now = counted(), counted()
    now[size] = round(before[size] * 1.02)
    assert grown(now, before, "m4f.float") == [f"m4f.float.{size}: {now[size]}, the baseline is {before[size]}"]


def test_smaller_figures_pass() -> None:
    assert grown(counted(500, 700), counted(1000, 1500), "m4f.float") == []


def test_counts_of_states_are_not_judged() -> None:
    now = counted()
    now["permitted_ticks"] += 5000
    now["contact"]["rank_deficient"] += 5000
    assert grown(now, counted(), "m4f.float") == []


def test_a_number_that_is_no_longer_counted_does_not_pass() -> None:
    now = counted()
    del now["contact"]["stages"]["index"]
    assert grown(now, counted(), "m4f") == ["m4f.contact.stages.index is in the baseline and was not counted"]


def test_counts_over_another_number_of_states_do_not_pass() -> None:
    now = counted()
    now["contact"]["states"] = 100
    assert grown(now, counted(), "m4f") == ["m4f.contact.states: 100, the baseline has 10000"]


def test_a_target_without_a_baseline_does_not_pass() -> None:
    results = {"m4f": {"float": counted(), "fixed": counted(), "flash_bytes": 24543}}
    verdict = judge(results, {"m4f": "gcc 12.2.0"}, baseline_of(counted()), "debian 12")
    assert (verdict.passed, verdict.failed) == (1, 1)
    assert verdict.failures == ["m4f.fixed has no baseline"]


def test_counts_of_another_compiler_are_reported_and_not_compared() -> None:
    results = {"m4f": {"float": counted(2000, 3000)}}
    verdict = judge(results, {"m4f": "gcc 13.2.0"}, baseline_of(counted()), "ubuntu 24.04")
    assert (verdict.passed, verdict.failed, verdict.failures) == (0, 0, [])
    assert verdict.skipped == ["optional: counts on m4f: the baseline is by gcc 12.2.0, these by gcc 13.2.0"]


def test_on_the_baselines_own_system_another_compiler_is_not_optional() -> None:
    """Otherwise CI would pass without a comparison."""
    verdict = judge({"m4f": {"float": counted()}}, {"m4f": "gcc 12.3.0"}, baseline_of(counted()), "debian 12")
    assert verdict.skipped == ["counts on m4f: the baseline is by gcc 12.2.0, these by gcc 12.3.0"]


def test_the_committed_baseline_has_every_target_numeric_type_and_case() -> None:
    baseline = json.loads((ROOT / "tools" / "bench" / "baseline.json").read_text())
    assert set(baseline) == {*TARGETS, "about"}
    assert set(baseline["about"]["compilers"]) == set(TARGETS)
    for target in TARGETS:
        assert set(baseline[target]) - {"second_channel"} == {"float", "fixed", *images.SIZES}
        for numeric in ("float", "fixed"):
            counts = baseline[target][numeric]
            for case in images.CASES:
                assert 0 < counts[case]["mean"] <= counts[case]["worst"]
                assert counts[case]["states"] == 10000
                assert set(counts[case]["stages"]) == set(STAGES.get(case, STAGES["none"]))
            assert counts["contact"]["rank_deficient"] > 1000  # some of the states are singular
            assert counts["painted_stack_bytes"] <= counts["stack_bytes"]


def test_the_peer_with_the_lowest_mean_represents_a_case() -> None:
    slow, fast = counted(3000, 4000), counted(2000, 5000)
    fast["none"] = {**fast["none"], "mean": 9000}
    best = images.best_of({"casadi_svd-O2": slow, "casadi_qr-O3": fast})
    assert best["contact"]["peer"] == "casadi_qr-O3"
    assert (best["contact"]["mean"], best["contact"]["worst"]) == (2000, 5000)
    assert best["none"]["peer"] == "casadi_svd-O2"
    assert set(best["contact"]["each"]) == {"casadi_svd-O2", "casadi_qr-O3"}


def test_a_peer_that_computes_something_else_is_an_error() -> None:
    def agree(peer: str, quantity: str, states: int, ppm: int) -> list[str]:
        return ["agree", peer, quantity, str(states), str(ppm)]

    good = [agree("casadi", "momentum", 10000, 3), agree("eigen_qr", "contact", 7947, 148)]
    assert images.read_agreement(good)["eigen_qr"] == {"contact": {"states": 7947, "ppm": 148}}
    with pytest.raises(RuntimeError, match="eigen_qr and ours differ in contact by 20000 ppm"):
        images.read_agreement([*good, agree("eigen_qr", "contact", 7947, 20000)])
    with pytest.raises(RuntimeError, match="over 0 states"):
        images.read_agreement([agree("eigen_svd", "payload", 0, 0)])
    with pytest.raises(RuntimeError, match="nothing was compared"):
        images.read_agreement([])


def test_the_table_fits_80_columns() -> None:
    ours = counted(144982, 269053)
    peers = images.best_of({"pinocchio_svd-O3": counted(1444982, 2269053), "casadi_qr-O2": counted()})
    peers["agreement"] = {f"{name}-O2": {"contact": {"states": 7947, "ppm": 148}} for name in PEERS}
    results = {"host": {"float": ours, "fixed": copy.deepcopy(ours), "flash_bytes": 24543}}
    text = table(results, {"host": {"float": peers}})
    assert max(len(line) for line in text.splitlines()) <= 80
    assert "x9.97/8.43" in text


def test_a_count_above_its_bound_is_a_failure() -> None:
    now = counted()
    bound = BOUNDS["m4f", "float"]["d_p", ""]
    now["d_p"]["worst"] = bound + 1
    verdict = judge({"m4f": {"float": now}}, {"m4f": "gcc 12.2.0"}, baseline_of(now), "debian 12")
    assert verdict.failures == [f"m4f.float.d_p: {bound + 1}, above {bound}"]

"""The cost of a projection has a bound that holds for any bits, and docs/guard.md states it."""

import pytest
from checkout import ROOT
from emulator import BUILD, built, run_to_end
from worst_case import LIMITS


@pytest.mark.needs("qemu", "arm")
@pytest.mark.parametrize(("target", "build"), LIMITS)
def test_no_input_makes_a_projection_more_expensive_than_its_limit(target: str, build: str) -> None:
    image = BUILD / f"worst-{target}-{build}.elf"
    code, output = run_to_end(target, built(str(image.relative_to(ROOT)), image))
    stages, projection = map(int, output.split()[-2:])
    print(output)
    cycle_limit, projection_limit = LIMITS[target, build]
    assert code == 0
    assert 0 < stages <= cycle_limit
    assert projection_limit / 4 < projection <= projection_limit  # the limit is not much too high


@pytest.mark.gate
def test_the_limits_agree_with_the_document() -> None:
    text = (ROOT / "docs" / "guard.md").read_text()
    for build, name in (("float", "float"), ("fixed", "Q9.22")):
        for kind, which in (("cycle", 0), ("projection", 1)):
            numbers = [f"{LIMITS[target, build][which]:,}" for target in ("m3", "m4f", "m7", "r5f")]
            assert f"| {kind}, {name} | {' | '.join(numbers)} |" in text

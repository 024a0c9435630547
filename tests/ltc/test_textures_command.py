"""``python -m ltc textures``: what is printed, exit codes."""

import re

import pytest

from ltc.__main__ import main
from ltc.textured_check import KINDS, METHODS

FEW = ["--configurations", "12", "--size", "16", "--pictures", "1"]


@pytest.mark.parametrize(
    ("lobe", "outline"), [("ltc", "ring"), ("diffuse", "star"), ("ggx", "rectangle")]
)
def test_prints_every_method(lobe: str, outline: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["textures", "--lobe", lobe, "--outline", outline, "--half", *FEW]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    for method in METHODS:
        rows = re.findall(rf"^{method} .*$", printed.out, re.MULTILINE)
        assert len(rows) == 2  # by picture, by alpha
    for kind in KINDS:
        assert kind in printed.out
    assert float(re.search(r"estimated at most (\S+)", printed.out).group(1)) < 1e-3  # type: ignore[union-attr]


def test_bad_input_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["textures", "--size", "4"]) == 2
    assert capsys.readouterr().err == "python -m ltc: size is 4, expected 8 or more\n"
    with pytest.raises(SystemExit) as leaving:
        main(["textures", "--lobe", "phong"])
    assert leaving.value.code == 2

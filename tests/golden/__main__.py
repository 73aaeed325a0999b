"""Write the golden files anew."""

import sys

import pytest

from tests.golden.conftest import REWRITE
from tests.house.source import ROOT

sys.exit(pytest.main([str(ROOT / "tests" / "golden"), REWRITE, "-q", "-p", "no:cacheprovider"]))

"""What every test shares: repeatable examples from Hypothesis, and a viewer that reports nothing."""

import os

from hypothesis import settings

# The first example of a compiled function includes its compilation, so no deadline; a run that fails in one place
# and passes in another helps nobody, so the examples are the same everywhere.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")

# Also for the processes that tests start: Rerun reports usage unless told not to, and this is the way to tell it.
os.environ["CI"] = "true"

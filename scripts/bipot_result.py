"""The former name of bipot.result, for scripts that import it."""

from bipot.result import *  # noqa: F403

"""Plans experiments: how long, which frequencies and which amplitude, for a wanted error."""

from tvident._plan.call import plan_experiment
from tvident._plan.plan import ExperimentPlan

__all__ = ["ExperimentPlan", "plan_experiment"]

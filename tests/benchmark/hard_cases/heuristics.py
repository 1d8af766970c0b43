"""Heuristics of the solvers, by name, and the options that turn each of them off."""

from typing import Any

#: No number of anything comes to this.
NEVER = 10**9

WITHOUT: dict[str, dict[str, Any]] = {
    "modified-newton": {"modified_newton.steps": 0},
    "anderson-acceleration": {"anderson.steps": 0},
    "anderson-restarts": {"anderson.restarts": 0},
    "step-lengthening": {"step_lengthening.most": 1.0},
    "core-shares": {"inertia_correction.core_shares": (1.0,)},
    "skipped-core-shares": {"inertia_correction.many_negative": NEVER},
    "negative-first-matrix": {"inertia_correction.first_negative": 0},
    "viscous-matrices": {"inertia_correction.viscous_steps": 0},
    "rates-by-negative-pivots": {
        "inertia_correction.rates_of_two": (0.2, 0.8, 3.2, 12.8),
        "inertia_correction.rates_of_more": (0.2, 0.8, 3.2, 12.8),
    },
    "monotonicity-test": {"line_search.halvings": 0},
    "long-steps": {"newton.long_steps": NEVER},
    "stagnation": {"newton.stagnant_iterations": NEVER},
    "rough-states": {"convergence.rough_step": 0.0, "convergence.rough_next_step": 0.0},
    "expected-next-step": {"convergence.rough_next_step": 0.0},
    "parabola": {"continuation.earlier_states": 1},
    "extrapolation": {"continuation.earlier_states": 0},
    "bound-after-failure": {"continuation.after_failure": 1e9},
    "halvings-before-relaxation": {"continuation.halvings": 0},
    "missed-goal": {"continuation.missed_share": 0.0},
    "bound-after-failure-in-time": {"viscous_relaxation.after_failure": 1e9},
}

"""Run trials: tasks, skills and the worker that speaks to a learner."""

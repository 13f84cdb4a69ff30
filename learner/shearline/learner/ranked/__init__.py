"""PSP whose partition ranks instead of gates, with a model of reliability beside it.

``config`` holds its numbers, ``window`` the trials a fit looks at, ``reliability`` the chance of
success, ``cost`` what a success costs, ``score`` both as one number, ``elite`` where to draw
from, ``ranking`` the partition, ``model`` all of them for one episode, ``ranked`` the learner.
"""

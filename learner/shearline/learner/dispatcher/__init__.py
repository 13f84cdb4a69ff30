"""The dispatcher: who gets which trial, and what is lost, late or duplicate.

A pure state machine. Tell it events and the time, carry out the instructions it returns, in
order::

    dispatcher = Dispatcher(rules, token=secrets_token)
    for instruction in dispatcher.handle(Begin(), now_s):
        ...
"""

from shearline.learner.dispatcher.book import Book
from shearline.learner.dispatcher.checks import check
from shearline.learner.dispatcher.core import Dispatcher
from shearline.learner.dispatcher.entries import AnyEntry, Entry
from shearline.learner.dispatcher.observed import history
from shearline.learner.dispatcher.rules import Rules
from shearline.learner.dispatcher.status import status

__all__ = [
    "AnyEntry",
    "Book",
    "Dispatcher",
    "Entry",
    "Rules",
    "check",
    "history",
    "status",
]

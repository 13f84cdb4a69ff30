"""What all tests share: hypothesis without deadlines, for a busy machine is not a slow program."""

from hypothesis import settings

settings.register_profile("shearline", deadline=None)
settings.load_profile("shearline")

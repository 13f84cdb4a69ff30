"""Parameter space partitioning (PSP), the paper's section 3, in its parts.

``config`` holds every choice the paper leaves open, ``reward`` the mean reward and the labels it
makes, ``proposal`` the Gaussian mixture, ``partition`` the support vector machine, ``psp`` the
learner that is made of them.
"""

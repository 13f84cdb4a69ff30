"""Where on the record each message goes, and the two messages that only the record has.

A topic carries one type. Nothing here knows how a message is encoded or when it is written.
"""

from __future__ import annotations

from dataclasses import dataclass

from shearline.protocol import messages
from shearline.protocol.messages import Message
from shearline.protocol.scene import SceneData

RUN = "/run"
LOG = "/log"
TIP = "/trial/tip"
SCENE = "/scene"
TF = "/tf"
TF_FIXED = "/tf_static"


class RunConfig(Message, frozen=True, kw_only=True, tag="run"):
    """What was asked for, resolved; written once at the head of every file.

    Attributes:
        run: Name of the run.
        text: The run folder's ``run.toml``, verbatim.
        names: Parameter names, in the order of every ``theta``.
        units: One unit for each parameter.
        low: Lower bounds, in those units.
        high: Upper bounds, in those units.
        at_s: When this file was begun [s since the epoch].
    """

    run: str
    text: str
    names: list[str]
    units: list[str]
    low: list[float]
    high: list[float]
    at_s: float


@dataclass(frozen=True, slots=True)
class Topic:
    """One channel of the record.

    Attributes:
        name: As it stands in the MCAP, e.g. ``"/trial/outcome"``.
        schema: Full name of its protobuf type.
        about: What it carries and on which clock; kept as the channel's metadata.
    """

    name: str
    schema: str
    about: str


#: Message type to topic, for everything that has a type of its own.
TOPICS: dict[type[Message], Topic] = {
    kind: Topic(name, f"shearline.{kind.__name__}", about)
    for kind, name, about in (
        (RunConfig, RUN, "what was asked for, resolved; at_s in s since the epoch"),
        (messages.EpisodeClosed, "/episode", "one message per closed episode"),
        (messages.Proposed, "/trial/proposed", "one message per trial that came into being"),
        (messages.Counted, "/trial/outcome", "one message per trial that reached its outcome"),
        (
            messages.TraceData,
            "/trial/trace",
            "one per traced attempt; data is column after column; t_s is the trial's clock in s",
        ),
        (messages.EvaluatorState, "/evaluator/state", "where one evaluator stands, at each change"),
        (messages.Snapshot, "/learner/model", "the learner's model after an episode, JSON text"),
        (
            SceneData,
            "/scene/bodies",
            "what trials look like; columns move it",
        ),
        (messages.Status, "/status", "the run at a glance, about twice a second"),
        (messages.Wire, "/wire", "protocol messages as the learner saw or sent them, msgpack"),
    )
}

#: Topics of standard types, readable in 3-D and log panels without our code.
LOG_TOPIC = Topic(LOG, "foxglove.Log", "what the recorder has to say")
TIP_TOPIC = Topic(TIP, "foxglove.PosesInFrame", "path of the tip of one trial, thinned; in m")
SCENE_TOPIC = Topic(SCENE, "foxglove.SceneUpdate", "bodies in their own frames; in m")
TF_TOPIC = Topic(
    TF, "foxglove.FrameTransforms", "where bodies are, trial after trial, each in the time it took"
)
FIXED_TOPIC = Topic(TF_FIXED, "foxglove.FrameTransforms", "where bodies are that do not move")
STANDARD = (LOG_TOPIC, TIP_TOPIC, SCENE_TOPIC, TF_TOPIC, FIXED_TOPIC)

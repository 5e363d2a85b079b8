"""The mapping from a session's steps to ROS 2 messages on topics.

Topics and types are those of a robot that `benchbot bridge ros2` presents, so that a reader of one can read the other.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from benchbot.plugin import BenchbotError, ExitCode, FailureClass, Progress, Step
from benchbot_record_mcap import exact, messages

COLOUR, DEPTH, SEGMENTATION = "/camera/color", "/camera/depth", "/camera/segmentation"
ACTION, GOAL, PROGRESS = "/benchbot/action", "/benchbot/goal", "/benchbot/progress"
EXACT = "/benchbot/exact"

# `poses` calls the optical frame so on every robot; the channels `laser` and `imu` do not name theirs.
CAMERA_FRAME, LASER_FRAME, IMU_FRAME = "camera", "lidar", "imu_link"

TopicMessage = tuple[str, Any]


def of_step(
    action: str | None,
    arguments: Mapping[str, float],
    step: Step,
    progress: Progress,
    time_ns: int,
    *,
    tells_pose: bool,
) -> Iterator[TopicMessage]:
    """Yield (topic, message) of everything to record of one step: the action, what was observed, the progress.

    The progress has the true pose only with `tells_pose`: where the task tells it to solutions, too.

    Raises BenchbotError for an observation that its message cannot hold.
    """
    if action is not None:
        yield (
            ACTION,
            messages.text(
                {"action": action, "arguments": dict(arguments), "outcome": step.outcome, "result": step.result}
            ),
        )
    for channel in step.observations:
        try:
            yield from _of_channel(channel, step.observations, time_ns)
        except (KeyError, TypeError, ValueError) as error:
            raise BenchbotError(
                f"The recorder 'mcap' cannot write the observation '{channel}'.",
                f"It is not what the channel is defined to be, or a ROS 2 message cannot hold it: {error}.",
                "Run without --record mcap=…, and report it to the author of the simulator or driver.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            ) from error
    yield EXACT, exact.encode(step.observations)
    yield PROGRESS, messages.text(_progress(progress, tells_pose=tells_pose))


def _of_channel(channel: str, observations: Mapping[str, Any], time_ns: int) -> Iterator[TopicMessage]:
    value = observations[channel]
    camera = messages.header(time_ns, observations.get(f"{channel}_info", {}).get("frame_id", CAMERA_FRAME))
    match channel:
        case "image_rgb":
            yield f"{COLOUR}/image_raw", messages.image(value, "rgb8", camera)
        case "image_depth":
            yield f"{DEPTH}/image_raw", messages.image(value, "32FC1", camera)
        case "image_segment":
            yield f"{SEGMENTATION}/class", messages.image(value["class_segment_img"], "mono8", camera)
            yield f"{SEGMENTATION}/instance", messages.image(value["instance_segment_img"], "mono16", camera)
            yield f"{SEGMENTATION}/class_ids", messages.text(value["class_ids"])
        case "image_rgb_info" | "image_depth_info" | "image_segment_info":
            folder = {"image_rgb_info": COLOUR, "image_depth_info": DEPTH, "image_segment_info": SEGMENTATION}[channel]
            yield f"{folder}/camera_info", messages.camera_info(value, messages.header(time_ns, value["frame_id"]))
        case "laser":
            yield "/scan", messages.laser_scan(value, messages.header(time_ns, LASER_FRAME))
        case "lidar":
            yield "/points", messages.point_cloud(value, messages.header(time_ns, value["frame_id"]))
        case "imu":
            yield "/imu", messages.imu(value, messages.header(time_ns, IMU_FRAME))
        case "joint_states":
            yield "/joint_states", messages.joint_state(value, messages.header(time_ns, ""))
        case "poses":
            yield "/tf", messages.transforms(value, time_ns)
        case "goal":
            goal = {"class": value} if isinstance(value, str) else {"fetch": value}
            if hasattr(value, "tolist"):
                goal = {"position_xy": value.tolist()}
            yield GOAL, messages.text(goal)
        case _:
            raise ValueError("no ROS 2 message is chosen for it")


def _progress(progress: Progress, *, tells_pose: bool) -> dict[str, Any]:
    """Return the progress without wall time, which differs from run to run.

    A solution might read the recording while it runs: where the task hides the true pose, it has neither that nor time.
    """
    true = {
        progress.time_key: progress.simulated_time_s,
        "pose_xyyaw": progress.pose_xyyaw,
        "path_length_m": progress.path_length_m,
    }
    return {
        "state": progress.state,
        "scene_number": progress.scene_number,
        "steps": progress.steps,
        "trajectory_index": progress.trajectory_index,
        "trajectory_length": progress.trajectory_length,
        "last_action": progress.last_action,
        "frames": progress.frames,
        "failure": progress.failure,
        "failure_why": progress.failure_why,
        **(true if tells_pose else {}),
    }

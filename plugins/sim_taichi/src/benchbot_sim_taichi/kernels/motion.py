# mypy: ignore-errors
"""Whole actions of many robots in one launch: steering, drive, contact, and coming to rest.

On a processor each thread moves a robot. On a GPU the threads of a warp do the same for one robot, and share the edges
that are searched for the nearest: what a robot does near a wall is a chain of thousands of such searches.

`benchbot.plugins.simulation.many_motion` does the same with arrays of numpy, and says where it is written for one
robot. Operations are in its order and in 64 bits, so that results on a processor are its own to the last bit (compiled
without fused or reordered arithmetic: `_ti.exact_arithmetic`). Literals are 32 bits wide here: those with digits that
do not fit are among `numbers`.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.traversal import ints

doubles = ti.types.ndarray(dtype=ti.f64, ndim=1)

(X, Y, YAW, LINEAR, ANGULAR, LINEAR2, ANGULAR2, CLOCK, KNOWN_X, KNOWN_Y, KNOWN_CLEARANCE, INSTANT, COLLIDED) = range(13)
NUMBERS = (
    "period_s",
    "period_s2",
    "backwards_mps",
    "forwards_mps",
    "turning_radps",
    "planned_mps2",
    "planned_radps2",
    "position_tolerance_m",
    "angle_tolerance_rad",
    "phase_timeout_s",
    "drive_backwards_mps",
    "drive_forwards_mps",
    "drive_radps",
    "drive_mps2",
    "drive_radps2",
    "radius_m",
    "longest_substep_m",
    "widest_substep_rad",
    "fine_share",
    "rest_mps",
    "rest_radps",
    "rest_timeout_s",
    "contact_tolerance_m",
    "bent_rad",
    "pi",
    "two_pi",
    "cell_size_m",
    "k_heading",
    "k_lateral",
)
(
    PERIOD_S,
    PERIOD_S2,
    BACKWARDS_MPS,
    FORWARDS_MPS,
    TURNING_RADPS,
    PLANNED_MPS2,
    PLANNED_RADPS2,
    POSITION_TOLERANCE_M,
    ANGLE_TOLERANCE_RAD,
    PHASE_TIMEOUT_S,
    DRIVE_BACKWARDS_MPS,
    DRIVE_FORWARDS_MPS,
    DRIVE_RADPS,
    DRIVE_MPS2,
    DRIVE_RADPS2,
    RADIUS_M,
    LONGEST_SUBSTEP_M,
    WIDEST_SUBSTEP_RAD,
    FINE_SHARE,
    REST_MPS,
    REST_RADPS,
    REST_TIMEOUT_S,
    CONTACT_TOLERANCE_M,
    BENT_RAD,
    PI,
    TWO_PI,
    CELL_SIZE_M,
    K_HEADING,
    K_LATERAL,
) = range(len(NUMBERS))
MAP_STRIDE = 6
"""Of each world: first column and row, columns, rows, the number of its first cell, and of that with all edges."""
OUTCOMES = ("reached", "blocked", "collided", "timeout")
REACHED, BLOCKED, COLLIDED_END, TIMEOUT = range(len(OUTCOMES))
WARP = 32
HALVES = (16, 8, 4, 2, 1)


@ti.func
def clearance_m(
    world,
    x,
    y,
    maps: ti.template(),
    starts: ti.template(),
    near: ti.template(),
    edges: ti.template(),
    numbers: ti.template(),
    thread,
    shared: ti.template(),
    threads: ti.template(),
):
    """Room around a robot at a point to the nearest edge of a world; all `threads` of a block call it together."""
    at = world * MAP_STRIDE
    column = ti.cast(ti.floor(x / numbers[CELL_SIZE_M]), ti.i32) - maps[at]
    row = ti.cast(ti.floor(y / numbers[CELL_SIZE_M]), ti.i32) - maps[at + 1]
    cell = maps[at + 5]
    if 0 <= column < maps[at + 2] and 0 <= row < maps[at + 3]:
        cell = maps[at + 4] + row * maps[at + 2] + column
    nearest = ti.cast(1e30, ti.f64)
    listed = starts[cell] + thread
    while listed < starts[cell + 1]:
        edge = near[listed] * 5
        along_x, along_y = edges[edge + 2], edges[edge + 3]
        away_x, away_y = x - edges[edge], y - edges[edge + 1]
        fraction = ti.min(ti.max((away_x * along_x + away_y * along_y) * edges[edge + 4], 0.0), 1.0)
        away_x -= fraction * along_x
        away_y -= fraction * along_y
        nearest = ti.min(nearest, away_x * away_x + away_y * away_y)
        listed += threads
    if ti.static(threads > 1):
        shared[thread] = nearest
        ti.simt.block.sync()
        for half in ti.static(HALVES):
            if thread < half:
                shared[thread] = ti.min(shared[thread], shared[thread + half])
            ti.simt.block.sync()
        nearest = shared[0]
        ti.simt.block.sync()
    return ti.sqrt(nearest) - numbers[RADIUS_M]


@ti.func
def believed_yaw(sin, cos):
    """Heading of a quaternion about the z axis: sine and cosine of half of it."""
    return ti.atan2(2.0 * (cos * sin), 1.0 - 2.0 * (sin * sin))


@ti.func
def wrapped(angle, numbers: ti.template()):
    """Within [-pi, pi) for angles within three turns of it, as Python's remainder has it."""
    turned = angle + numbers[PI]
    while turned >= numbers[TWO_PI]:
        turned -= numbers[TWO_PI]
    if turned < 0.0:
        while turned <= -numbers[TWO_PI]:
            turned += numbers[TWO_PI]
        if turned < 0.0:
            turned += numbers[TWO_PI]
    return turned - numbers[PI]


@ti.func
def rotated(sin, cos, x, y):
    """A point turned about the z axis; sine and cosine of half the angle."""
    cross_x, cross_y = -(sin * y) + cos * x, sin * x + cos * y
    return x + 2.0 * -(sin * cross_y), y + 2.0 * (sin * cross_x)


@ti.func
def braking_speed(remaining, planned, numbers: ti.template()):
    """The speed from which the planned deceleration ends where nothing remains."""
    return planned * (ti.sqrt(numbers[PERIOD_S2] + 2.0 * remaining / planned) - numbers[PERIOD_S])


@ti.func
def ramp(start, target, acceleration, elapsed_s):
    """Velocity after a while of ramping from `start` to `target`, and its integral."""
    ramp_s = ti.abs(target - start) / acceleration
    change = acceleration * elapsed_s
    velocity = start + ti.select(target < start, -change, change)
    way = (start + velocity) / 2.0 * elapsed_s
    if elapsed_s >= ramp_s:
        velocity = target
        way = (start + target) / 2.0 * ramp_s + target * (elapsed_s - ramp_s)
    return velocity, way


@ti.kernel
def execute(
    robots: ints,
    straight: ints,
    arguments: doubles,
    angles: doubles,
    states: doubles,
    worlds: ints,
    maps: ints,
    starts: ints,
    near: ints,
    edges: doubles,
    numbers: doubles,
    outcomes: ints,
    count: ti.i32,
    total: ti.i32,
    stops_before_contact: ti.i32,
    threads: ti.template(),
):
    """Execute an action of `count` of `total` robots; `states` has a row of each kind, with a value of each robot.

    `threads` is how many move one robot: 1 on a processor, WARP on a GPU.
    """
    ti.loop_config(block_dim=WARP)
    for index_of_thread in range(count * threads):
        lane, thread = index_of_thread // threads, index_of_thread % threads
        shared = ti.simt.block.SharedArray((WARP,), ti.f64) if ti.static(threads > 1) else 0
        robot = robots[lane]
        world = worlds[robot]
        nothing = ti.cast(0.0, ti.f64)
        x, y, yaw = states[X * total + robot], states[Y * total + robot], states[YAW * total + robot]
        linear, angular = states[LINEAR * total + robot], states[ANGULAR * total + robot]
        linear2, angular2 = states[LINEAR2 * total + robot], states[ANGULAR2 * total + robot]
        clock_s, instant = states[CLOCK * total + robot], states[INSTANT * total + robot]
        known_x, known_y = states[KNOWN_X * total + robot], states[KNOWN_Y * total + robot]
        known_m = states[KNOWN_CLEARANCE * total + robot]
        collided = states[COLLIDED * total + robot] != 0.0
        period_s = numbers[PERIOD_S]
        if ti.static(threads > 1):
            ti.simt.block.sync()  # until all have read what the first of them writes

        start_sin, start_cos = ti.sin(yaw / 2.0), ti.cos(yaw / 2.0)
        start_yaw = believed_yaw(start_sin, start_cos)
        # In the frame of the start.
        origin_x, origin_y = rotated(-start_sin, start_cos, x, y)
        on_line = straight[lane]
        angle = angles[lane]
        turned, last_yaw = nothing, start_yaw
        outcome = REACHED
        phases = 1 + on_line
        while phases > 0 and outcome == REACHED:
            phases -= 1
            deadline_s = clock_s + numbers[PHASE_TIMEOUT_S]
            resting, done, is_first = 0, 0, 1
            last_error, rest_began_s = nothing, nothing
            while done == 0:
                wanted_linear, wanted_angular, error = nothing, nothing, nothing
                at_rest = 0
                if resting == 1:
                    still = ti.abs(linear) < numbers[REST_MPS] and ti.abs(angular) < numbers[REST_RADPS]
                    at_rest = ti.cast(still or not (clock_s - rest_began_s < numbers[REST_TIMEOUT_S]), ti.i32)
                if not collided and (resting == 0 or (at_rest == 1 and outcome == REACHED)):
                    sin, cos = ti.sin(yaw / 2.0), ti.cos(yaw / 2.0)
                    if on_line == 1:
                        here_x, here_y = rotated(-start_sin, start_cos, x, y)
                        along_m, lateral_m = -origin_x + here_x, -origin_y + here_y
                        off_sin = start_cos * sin + -start_sin * cos
                        off_cos = start_cos * cos - -start_sin * sin
                        off_rad = believed_yaw(off_sin, off_cos)
                        remaining_m = arguments[lane] - along_m
                        speed_mps = braking_speed(ti.abs(remaining_m), numbers[PLANNED_MPS2], numbers)
                        if remaining_m >= 0.0:
                            wanted_linear = ti.min(speed_mps, numbers[FORWARDS_MPS])
                        else:
                            wanted_linear = ti.max(-speed_mps, numbers[BACKWARDS_MPS])
                        steered = (
                            -numbers[K_HEADING] * ti.abs(wanted_linear) * off_rad
                            - numbers[K_LATERAL] * wanted_linear * lateral_m
                        )
                        limit = numbers[TURNING_RADPS]
                        wanted_angular = ti.max(-limit, ti.min(limit, steered))
                        error = ti.abs(remaining_m) / numbers[POSITION_TOLERANCE_M]
                    else:
                        now_yaw = believed_yaw(sin, cos)
                        turned += wrapped(now_yaw - last_yaw, numbers)
                        last_yaw = now_yaw
                        remaining = angle - turned
                        error = ti.abs(remaining) / numbers[ANGLE_TOLERANCE_RAD]
                        fastest = braking_speed(ti.abs(remaining), numbers[PLANNED_RADPS2], numbers)
                        fastest = ti.min(fastest, numbers[TURNING_RADPS])
                        wanted_angular = ti.select(remaining < 0.0, -fastest, fastest)
                if at_rest == 1:
                    done = 1
                    if collided:
                        outcome = COLLIDED_END
                    elif outcome == REACHED and error > 1.0:
                        # Where the robot brakes worse than planned, it may have left the goal again.
                        resting, done, is_first = 0, 0, 1
                    continue

                is_checked = 0
                told = -1
                if resting == 0:
                    if collided:
                        told = COLLIDED_END
                    else:
                        there = error <= numbers[FINE_SHARE] or (is_first == 0 and last_error <= error <= 1.0)
                        if there:
                            told = REACHED
                        else:
                            last_error = error
                            is_first = 0
                            if clock_s >= deadline_s:
                                told = TIMEOUT
                            else:
                                is_checked = stops_before_contact
                if told >= 0:
                    outcome = told
                    resting = 1
                    rest_began_s = clock_s
                    continue

                if is_checked == 1:
                    fastest = ti.max(ti.abs(linear), ti.abs(wanted_linear))
                    reach_m = fastest * period_s + fastest * fastest / (2.0 * numbers[DRIVE_MPS2])
                    away_x, away_y = x - known_x, y - known_y
                    free_m = known_m - ti.sqrt(away_x * away_x + away_y * away_y)
                    if free_m > 0.0 and free_m > reach_m:
                        is_checked = 0
                    else:
                        known_x, known_y = x, y
                        known_m = clearance_m(world, x, y, maps, starts, near, edges, numbers, thread, shared, threads)
                        if known_m > reach_m:
                            is_checked = 0

                # The command ahead, braking after it, and then the command itself: the first two where it is checked.
                new_x, new_y, new_yaw, new_linear, new_angular = x, y, yaw, linear, angular
                is_hit = 0
                part = 2 - 2 * is_checked
                while part < 3:
                    if part != 1:
                        new_x, new_y, new_yaw, new_linear, new_angular = x, y, yaw, linear, angular
                    duration_s = period_s
                    to_linear = ti.min(ti.max(wanted_linear, numbers[DRIVE_BACKWARDS_MPS]), numbers[DRIVE_FORWARDS_MPS])
                    to_angular = ti.min(ti.max(wanted_angular, -numbers[DRIVE_RADPS]), numbers[DRIVE_RADPS])
                    if part == 1:
                        to_linear, to_angular = nothing, nothing
                        duration_s = ti.max(
                            ti.abs(new_linear) / numbers[DRIVE_MPS2], ti.abs(new_angular) / numbers[DRIVE_RADPS2]
                        )
                    longest = ti.max(ti.abs(new_linear), ti.abs(to_linear)) * duration_s / numbers[LONGEST_SUBSTEP_M]
                    widest = ti.max(ti.abs(new_angular), ti.abs(to_angular)) * duration_s / numbers[WIDEST_SUBSTEP_RAD]
                    substeps = ti.cast(ti.ceil(ti.max(ti.max(longest, widest), 1.0)), ti.i32)
                    from_linear, from_angular = new_linear, new_angular
                    way_m, way_rad = nothing, nothing
                    index = 1
                    while index <= substeps and is_hit == 0:
                        elapsed_s = duration_s * (ti.cast(index, ti.f64) / ti.cast(substeps, ti.f64))
                        next_linear, so_far_m = ramp(from_linear, to_linear, numbers[DRIVE_MPS2], elapsed_s)
                        next_angular, so_far_rad = ramp(from_angular, to_angular, numbers[DRIVE_RADPS2], elapsed_s)
                        half_rad = (so_far_rad - way_rad) / 2.0
                        chord_m = so_far_m - way_m
                        if ti.abs(half_rad) > numbers[BENT_RAD]:
                            chord_m *= ti.sin(half_rad) / half_rad
                        next_x = new_x + chord_m * ti.cos(new_yaw + half_rad)
                        next_y = new_y + chord_m * ti.sin(new_yaw + half_rad)
                        next_yaw = new_yaw + (so_far_rad - way_rad)
                        way_m, way_rad = so_far_m, so_far_rad
                        away_x, away_y = next_x - known_x, next_y - known_y
                        free_m = known_m - ti.sqrt(away_x * away_x + away_y * away_y)
                        if not free_m > 0.0:
                            known_x, known_y = next_x, next_y
                            known_m = clearance_m(
                                world, next_x, next_y, maps, starts, near, edges, numbers, thread, shared, threads
                            )
                            free_m = known_m
                        if free_m < 0.0:
                            is_hit = 1
                            if part == 2:  # up to where contact begins, at rest
                                away_x, away_y = next_x - new_x, next_y - new_y
                                while ti.sqrt(away_x * away_x + away_y * away_y) > numbers[CONTACT_TOLERANCE_M]:
                                    known_x, known_y = (new_x + next_x) / 2.0, (new_y + next_y) / 2.0
                                    middle_yaw = (new_yaw + next_yaw) / 2.0
                                    known_m = clearance_m(
                                        world,
                                        known_x,
                                        known_y,
                                        maps,
                                        starts,
                                        near,
                                        edges,
                                        numbers,
                                        thread,
                                        shared,
                                        threads,
                                    )
                                    if known_m < 0.0:
                                        next_x, next_y, next_yaw = known_x, known_y, middle_yaw
                                    else:
                                        new_x, new_y, new_yaw = known_x, known_y, middle_yaw
                                    away_x, away_y = next_x - new_x, next_y - new_y
                                new_linear, new_angular = nothing, nothing
                        else:
                            new_x, new_y, new_yaw = next_x, next_y, next_yaw
                            new_linear, new_angular = next_linear, next_angular
                        index += 1
                    part += 1
                    if is_hit == 1 and part < 3:
                        outcome = BLOCKED
                        part = 3
                if outcome == BLOCKED and resting == 0:
                    resting = 1
                    rest_began_s = clock_s
                    continue
                linear2, angular2 = (new_linear - linear) / period_s, (new_angular - angular) / period_s
                x, y, yaw, linear, angular = new_x, new_y, new_yaw, new_linear, new_angular
                if is_hit == 1:
                    collided = True
                clock_s += period_s
                instant += 1.0
            if phases > 0 and outcome == REACHED:
                # A drive ends with the heading that it began with.
                on_line = 0
                last_yaw = believed_yaw(ti.sin(yaw / 2.0), ti.cos(yaw / 2.0))
                angle = wrapped(start_yaw - last_yaw, numbers)
                turned = nothing
        states[X * total + robot], states[Y * total + robot], states[YAW * total + robot] = x, y, yaw
        states[LINEAR * total + robot], states[ANGULAR * total + robot] = linear, angular
        states[LINEAR2 * total + robot], states[ANGULAR2 * total + robot] = linear2, angular2
        states[CLOCK * total + robot], states[INSTANT * total + robot] = clock_s, instant
        states[KNOWN_X * total + robot], states[KNOWN_Y * total + robot] = known_x, known_y
        states[KNOWN_CLEARANCE * total + robot] = known_m
        states[COLLIDED * total + robot] = ti.select(collided, nothing + 1.0, nothing)
        outcomes[lane] = outcome

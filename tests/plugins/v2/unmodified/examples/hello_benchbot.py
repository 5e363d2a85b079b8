"""Restates v2's example of that name: it drives along a line and turns round, some times, and saves no result."""

from benchbot_api import ActionResult, Agent, BenchBot

LINE = [("move_distance", {"distance": 0.1}), ("move_angle", {"angle": 90}), ("move_angle", {"angle": 90})]


class Line(Agent):
    def __init__(self):
        self.left = LINE * 2

    def is_done(self, action_result):
        return not self.left or action_result != ActionResult.SUCCESS

    def pick_action(self, observations, action_list):
        if "move_distance" not in action_list or "move_angle" not in action_list:
            raise ValueError("no usable action")
        return self.left.pop(0)

    def save_result(self, filename, empty_results, results_format_fns):
        return


if __name__ == "__main__":
    BenchBot(agent=Line()).run()

"""Restates v2's example of that name: it follows the trajectory to its end, and saves no result."""

from benchbot_api import ActionResult, Agent, BenchBot


class Guided(Agent):
    def is_done(self, action_result):
        return action_result != ActionResult.SUCCESS

    def pick_action(self, observations, action_list):
        if "move_next" not in action_list:
            raise ValueError("no usable action")
        return ("move_next", {})

    def save_result(self, filename, empty_results, results_format_fns):
        return


if __name__ == "__main__":
    BenchBot(agent=Guided()).run()

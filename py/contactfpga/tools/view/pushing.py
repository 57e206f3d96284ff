"""A simulated robot, or copies side by side, in a server's page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.tools.view import chart, contacts, obstacle
from contactfpga.tools.view.bodies import OVERVIEW, ROBOT_SIDES, DrawnRobot, RobotView, pushes, state_line
from contactfpga.tools.view.cameras import Side
from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.panel import MOST_N, shortened
from contactfpga.tools.view.robot_source import ALL, BARE, NO_REFLEX, SKINS, SWEEP_S, RobotCopy, SimulatedSource
from contactfpga.tools.view.robot_stage import ROOT, RobotStage
from contactfpga.tools.view.sources import KEEPS_UP
from contactfpga.tools.view.tiles import MM

if TYPE_CHECKING:
    import viser

PUSH_N = 5.0
APART = 2.3
"""Distance of copies, in radii of a robot at its start."""
ABOVE = 0.1
ABREAST = Side(np.array([1.0, 0.0, 0.7]), np.array([0.0, 0.0, 1.0]))


class SimulatedView(RobotView):
    def __init__(self, server: viser.ViserServer, source: SimulatedSource):
        self._server, self._source = server, source
        self._stages: list[RobotStage] = []
        self._names: list[Any] = []
        self.hands = {name: Hand.on(link, source.body.links[name].skin.sheet) for name, link in source.links.items()}
        for hand in self.hands.values():
            hand.force_n = PUSH_N
        self._grips: dict[int, obstacle.Grip] = {}
        self._put_s = np.inf
        """Time of choosing an obstacle not yet drawn."""
        self._drawn: list[RobotCopy] = []
        self._robots: list[DrawnRobot] = []
        self._arrange()
        super().__init__(server, self._points_m)
        self._chart = server.gui.add_html("")
        self._add_pushing()
        self._add_rest(server, source.title)

    # ---- what is drawn

    def _points_m(self) -> np.ndarray:
        return np.concatenate([robot.stage.points_m() for robot in self._robots])

    def _arrange(self) -> None:
        self._drawn = copies = self._source.copies
        while len(self._stages) < len(copies):
            self._add_stage()
        self.stage = self._stages[0]
        for stage in self._stages:
            stage.show(stage in self._stages[: len(copies)])
        self._robots = [DrawnRobot(stage, self._source.body.links) for stage, _ in zip(self._stages, copies)]
        self.stage.shift(np.zeros(3))
        self.stage.place(copies[0].poses())
        points = self.stage.points_m()[:, :2]
        radius = float(np.linalg.norm(points - (points.min(0) + points.max(0)) / 2, axis=-1).max())
        for number, (stage, copy) in enumerate(zip(self._stages, copies)):
            stage.shift(np.array([0.0, APART * radius * (number - (len(copies) - 1) / 2), 0.0]))
            stage.place(copy.poses())
            self._names[number].position = (0.0, 0.0, float(self.stage.points_m()[:, 2].max()) + ABOVE * radius)
            self._names[number].visible = len(copies) > 1
            for sheet in stage.stages.values():
                sheet.labeled = contacts.MOST if len(copies) == 1 else 0  # the table has them

    def _add_stage(self) -> None:
        node = f"{ROOT}{len(self._stages)}"
        stage = RobotStage(self._server, self._source.body, self._source.solids(), node)
        self._stages.append(stage)
        add_label = self._server.scene.add_label
        self._names.append(add_label(f"{node}/skin", "", anchor="bottom-center", font_screen_scale=0.9))
        for name, hand in self.hands.items():
            stage.stages[name].press_with(hand)
        for kind in (obstacle.BALL, obstacle.HAND):
            stage.on_drag(f"obstacle {kind}", self._drag)
        self._show_obstacle(stage)

    def _show_obstacle(self, stage: RobotStage) -> None:
        for kind in (obstacle.BALL, obstacle.HAND):
            stage.show(kind == self._source.obstacle.kind, f"obstacle {kind}")

    async def _drag(self, event: Any) -> None:
        eye = np.array(event.client.camera.position)
        if event.phase == "start":
            self._grips[event.client_id] = obstacle.Grip(self._source.obstacle, eye, np.array(event.start_position))
        elif event.phase == "update" and event.client_id in self._grips:
            self._grips[event.client_id].drag(eye, np.array(event.end_position))
        else:
            self._grips.pop(event.client_id, None)

    def draw(self) -> list[contacts.Row]:
        source, before = self._source, len(self._drawn)
        source.advance()
        if source.copies is not self._drawn:
            self._arrange()
            if len(self._drawn) != before:
                self._look_again()
        rows = [row for number in range(len(self._drawn)) for row in self._draw(number)]
        if source.simulated_s > self._put_s:  # MuJoCo knows where it is
            self._put_s = np.inf
            for stage in self._stages:
                self._show_obstacle(stage)
            for client in self._server.get_clients().values():
                self.cameras.fit(client.camera)
        return rows

    def _look_again(self) -> None:
        sides = self.cameras.sides
        sides[OVERVIEW] = ROBOT_SIDES[OVERVIEW] if len(self._drawn) == 1 else ABREAST
        for client in self._server.get_clients().values():
            self.cameras.show(client, OVERVIEW)

    def _draw(self, number: int) -> list[contacts.Row]:
        copy, robot, name = self._drawn[number], self._robots[number], self._names[number]
        robot.stage.place(copy.poses())
        several = len(self._drawn) > 1
        if several:
            name.text = f"{copy.skin}\nat most {max(copy.most_n.values()):.1f} N"
        rows = []
        for link, state in copy.states().items():
            worn, plan = copy.sheets[link], self._source.body.links[link]
            arrows = pushes(plan, worn.touches)
            if copy.skin == BARE:
                robot.stage.stages[link].draw_no_data(arrows)
                continue
            label = f"{link}, {copy.skin}" if several else link
            rows += robot.draw(link, state, worn.pressed, arrows, label)
        return rows

    # ---- the panel

    def _add_pushing(self) -> None:
        source, gui = self._source, self._server.gui
        with gui.add_folder("Robot"):
            skin = gui.add_dropdown("skin", (*SKINS, ALL), initial_value=source.skin)
            reflex = gui.add_dropdown("reflex", (NO_REFLEX, *source.reflexes), initial_value=source.reflex)
            barrier = gui.add_dropdown("in its way", obstacle.OBSTACLES, initial_value=source.obstacle.kind)
            force = gui.add_slider("force, N", 1.0, MOST_N, 0.5, PUSH_N)
            again = gui.add_button("Start again")

        def resize(_: Any) -> None:
            for hand in self.hands.values():
                hand.resize(force_n=force.value)

        def start(_: Any) -> None:
            for hand in self.hands.values():
                hand.lift()
            source.skin, source.reflex = skin.value, reflex.value
            source.restart()

        force.on_update(resize)
        skin.on_update(start)
        reflex.on_update(start)
        again.on_click(start)
        barrier.on_update(lambda _: self.put(barrier.value))
        # Whoever comes first sees it from its start.
        server = self._server
        server.on_client_connect(lambda _: source.restart() if len(server.get_clients()) == 1 else None)

    def put(self, kind: str) -> None:
        """Place an obstacle in front of the first sheet, or none."""
        plan = next(iter(self._source.body.links.values()))
        sheet, frame = self.stage.stages[plan.name], self._source.copies[0].poses()[plan.frame] @ plan.pose
        points = frame.apply(sheet.tiles.points_mm * MM)
        low, high = points.min(0), points.max(0)
        ahead = np.array([high[0] + obstacle.AHEAD_M, *((low + high) / 2)[1:]])
        self._source.obstacle.put(kind, obstacle.AWAY_M if kind == obstacle.NOTHING else ahead)
        self._put_s = self._source.simulated_s

    def tell(self) -> None:
        super().tell()
        curves = [
            (SKINS.index(copy.skin), f"{copy.skin}: at most {max(copy.most_n.values()):.1f} N") for copy in self._drawn
        ]
        self._chart.content = (
            f'<div class="chart">{chart.force_chart(self._source.sweep.forces_n, SWEEP_S, curves)}</div>'
        )

    def facts(self) -> list[tuple[str, str]]:
        source = self._source
        rows = [("source", shortened(source.title))]
        for copy in self._drawn:
            for name, state in copy.states().items():
                known = "no skin" if copy.skin == BARE else state_line(state)
                title = f"{name}, {copy.skin}" if len(self._drawn) > 1 else name
                rows.append((title, f"{known}; {copy.pressed_by(name)}"))
        if source.share <= KEEPS_UP:
            rows.append(("simulated", f"at {source.share:.0%} of real time"))
        return rows

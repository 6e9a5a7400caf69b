"""Building a design with the paper's kit: plans and bills; nothing is drawn here.

Source: S. Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft 2020:
the protocol of building, and the table of parts.
"""

from softvox_gym.build.bills import Bill, Line, bill
from softvox_gym.build.plans import Group, Inlet, Plan, places, plan

__all__ = ["Bill", "Group", "Inlet", "Line", "Plan", "bill", "places", "plan"]

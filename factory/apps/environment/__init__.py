"""A factory as a Gymnasium environment: an agent stands in for the controller of the plant.

Begin with `plant.FactoryEnv`; `programs.Programs` is the agent that follows the robots' programs.
"""

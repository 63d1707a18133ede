"""Behaviour trees in the XML of BehaviorTree.CPP: which nodes are built here, and how a file is read."""

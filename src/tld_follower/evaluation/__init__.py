# SPDX-License-Identifier: BSD-3-Clause
"""Scoring of trackers on annotated sequences and of flights in simulation."""

# SPDX-License-Identifier: BSD-3-Clause
"""Tracking-Learning-Detection (thesis section 3.1; Kalal, Mikolajczyk, Matas 2012)."""

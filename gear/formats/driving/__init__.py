"""Files that describe driving sequences: tracks (KITTI, MOTChallenge), optical flow, poses (KITTI odometry) and the
measurements of an inertial navigation system (KITTI raw data).
"""

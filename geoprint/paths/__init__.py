"""From contours to the pose stream: isolines, order, resampling, travel and attitude."""

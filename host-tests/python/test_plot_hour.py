"""A short part of plot_hour.py: the memory of the page is bounded, and no peak of the whole time is lost."""

from plot_hour import PEAK, RATE, run

#: Seconds of the bus: enough for samples that are no longer kept one by one.
SECONDS = 300.0
#: The limit for an hour, in MB.
LIMIT = 200.0


def test_samples_beyond_the_kept_time_are_reduced_and_keep_their_peak(driver):
    figures = run(driver, SECONDS)
    assert figures.lost == 0
    assert figures.first < 3 and figures.newest > SECONDS, "the plot covers the whole time"
    assert figures.samples < SECONDS * RATE * 0.95, "older samples are reduced"
    assert figures.greatest == PEAK
    assert figures.heap < LIMIT
    assert figures.listed == 127

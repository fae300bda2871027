"""What PEERS/record.py declares: its harmonics, and how far a found form is from them."""
import numpy as np

FORM = [(2, 3.0, 0.3), (3, 1.5, 1.0), (5, 0.7, 0.2), (7, 0.4, 2.0), (15, 0.2, 0.5), (48, 0.05, 0.1)]
GROWTH = 0.02  # of the form from station to station
X = [(2, 0.35, 0.4), (3, 0.15, 0.0)]
Y = [(2, 0.30, 0.1 - np.pi / 2), (4, 0.12, -np.pi / 2)]


def spectrum(lines, orders, scale=1.0):
    """Coefficients c of Re Σ c e^{+inφ} for Σ amplitude cos(nφ + phase), orders 0 to `orders` − 1."""
    found = np.zeros(orders, complex)
    for order, amplitude, phase in lines:
        found[order] += scale * amplitude * np.exp(1j * phase)
    return found


def error_um(found, lines, scale=1.0):
    """Root mean square over the turn of found minus true, orders from 2."""
    return float(np.sqrt(0.5 * np.sum(np.abs((found - spectrum(lines, len(found), scale))[2:]) ** 2)))


def form_errors_um(spectra):
    """[middle, worst] of the stations, in order."""
    errors = [error_um(found, FORM, 1 + GROWTH * k) for k, found in enumerate(spectra)]
    return [float(np.median(errors)), max(errors)]

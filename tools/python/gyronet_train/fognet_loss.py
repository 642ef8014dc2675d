"""The losses of FoGNet, for NumPy arrays and PyTorch tensors."""


def fognet_losses(correction, label, f1, fog, scale, alpha):
    """Returns the losses of the paper: Eq. 14 in units of `scale`, Eq. 15 and Eq. 16.

    `correction` and `label` (B) are in rad, `f1` and the gyro increments `fog` (B, 60) normalised.
    """
    loss1 = abs(correction - label).mean() / scale
    loss2 = abs(f1 - fog).mean()
    return loss1, loss2, loss1 + alpha * loss2

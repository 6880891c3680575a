"""Control moment gyroscopes: steering laws and the cascades of the DGVSCMG."""

"""What the book claims, and what of it holds: claims, the runs that they are judged by, and the page that is made of them."""

from hil.book.claim import Claim, ClaimVerdict, Judgement, Limit
from hil.book.page import what_holds
from hil.book.results import StoredResults

__all__ = ["Claim", "ClaimVerdict", "Judgement", "Limit", "StoredResults", "what_holds"]

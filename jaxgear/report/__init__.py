"""The report of a command: one HTML file that needs nothing else, and a workbook and a page of variants.

It shows what it is handed, tables, lines and pictures, and computes nothing. Needs the extra `report`.
"""

from .contents import Figure as Figure
from .contents import Report as Report
from .contents import Section as Section
from .contents import Source as Source
from .contents import Table as Table
from .contents import read_table as read_table
from .figures import CAPTIONS as CAPTIONS
from .figures import figure as figure
from .needed import needed as needed
from .page import write_report as write_report
from .variants import write_variants as write_variants
from .words import heading as heading
from .words import numbers as numbers
from .words import text as text
from .workbook import MOST_ROWS as MOST_ROWS
from .workbook import write_workbook as write_workbook
